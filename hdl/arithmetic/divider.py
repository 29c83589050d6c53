"""A divider finds a quotient bit by bit."""

from amaranth import Array, Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, only_if


class Divider(Box):
    """Divides serially, signed, non-restoring: gives ⌊2^s · dividend / divisor⌋, or the nearest integer to it.

    In each step the divisor is taken from the doubled remainder, or added if that is negative; so it stays within
    −divisor … divisor − 1. The signs that it passes through, inverted but for the first, are the digits of the quotient
    in two's complement: Σ ±2^i is their weighted sum, and the last one is the correction to a remainder that is not
    negative. The digits follow the dividend in its register, from which a bit goes to the remainder in each step. A
    counter shows when the last digit has come. It ends from any state, unlike a marker among the digits.

    The nearest integer is ⌊(2^s · dividend + ⌊divisor/2⌋) / divisor⌋, whose dividend has the divisor's bits at its end:
    so nothing is to be added to the quotient. These bits are read where they are, and no register takes the digits.

    The dividend is a sum. The adder of the steps makes it, so that none stands before it.

    Latency: `done` is high as many clocks after `start` as the quotient has bits, and one; a `start` before `done`, or
    together with it, begins the next division.

    - `integer_bits`: Of the quotient, without its sign: the quotient has as many, and s and the sign.
    - `zeros`: Bits at the end of each part of the dividend that are 0.
    """

    def __init__(
        self, *, divisor_width: int, integer_bits: int, scale_bits: int, nearest: bool = False, zeros: int = 0
    ) -> None:
        self._integer_bits = integer_bits
        self._steps = integer_bits + scale_bits
        self._scale_bits, self._nearest, self._zeros = scale_bits, nearest, zeros
        super().__init__(
            start=In(1),
            dividend=In(signed(divisor_width + integer_bits + 1)),  # its sum with `addend` is divided
            addend=In(signed(divisor_width + integer_bits + 1)),
            divisor=In(divisor_width),  # positive; valid with `start`, as both parts of the dividend
            running=Out(1),  # a digit is found in this clock
            digit=Out(1),  # of the quotient in two's complement, the sign first and inverted
            last=Out(1),  # if `running`, no digit follows this one
            done=Out(1),  # one clock: the quotient is new
            **only_if(not nearest, quotient=Out(signed(self._steps + 1))),  # held until the next start
            by=Out(divisor_width),  # the divisor, held until the next start
        )
        # Counts down to −1.
        self._left = Signal(signed((self._steps - 1).bit_length() + 1), name="left", reset_less=True)

    @property
    def dividend_digits(self) -> int:
        """Digits of the dividend that a register holds; the others, of half the divisor, are those of `by`."""
        if not self._nearest:
            return self._steps + 1
        return max(self._integer_bits - self._halved, 1)

    def next_digit_of(self, number: int) -> Value:
        """Return what `digit` would be in the clock after this one if the quotient were this number."""
        place = self._left[: (self._steps - 1).bit_length()]
        return Array(number >> self._reached(k) & 1 for k in range(1 << len(place)))[place]

    def _reached(self, place: int) -> int:
        """Return the place of the digit for one beyond: most bits are the same, so few have to be looked at."""
        for bit in reversed(range(place.bit_length() - 1)):
            if place < self._steps:
                break
            place &= ~(1 << bit)
        return place

    def build(self, m: Module) -> None:
        # Only the flags of work in progress need a reset; all else is loaded before it is used.
        left, running, start = self._left, self.running, self.start
        remainder = Signal(signed(len(self.by) + 1), reset_less=True)
        by = Signal.like(self.by, reset_less=True)
        halved, dividend = self._halved, self._dividend
        own = self._integer_bits - halved
        digits = Signal(self.dividend_digits, reset_less=True)
        m.d.comb += [self.by.eq(by), self.digit.eq(~remainder[-1]), self.last.eq(left[-1])]
        # 2·remainder ± by with one adder: −by is ~by + 1, and the 1 comes from an additional bit at the adder's end. At
        # the start the same adder has the two parts of the dividend.
        whole = slice(halved, halved + own + len(remainder))
        term = Cat(Const(0, own), by, Const(0)) ^ self.digit.replicate(own + len(by) + 1)
        one = Mux(start, dividend[whole], Cat(Const(0, own), digits[-1], remainder[:-1]))
        other = Mux(start, self.addend[whole], term)
        total = (Cat(1, one) + Cat(self.digit & ~start, other))[1:]
        coming: Value = self.digit
        if self._nearest:
            # Of half the divisor, as far behind as there are digits.
            coming = Cat(Const(0, len(digits)), by[1:]).bit_select(left[:-1], 1)
        else:
            m.d.comb += self.quotient.eq(Cat(digits[:-1], ~digits[-1]))
        m.d.sync += self.done.eq(running & left[-1] & ~start)
        with m.If(running | start):
            m.d.sync += remainder.eq(total[own:])
        with m.If(running):
            m.d.sync += [digits.eq(Cat(coming, digits)), left.eq(left - 1)]
        with m.If(left[-1]):
            m.d.sync += running.eq(0)
        with m.If(start):
            first = Cat(Const(0, len(digits) - own), total[:own]) if own else self.divisor >> self._steps
            m.d.sync += [running.eq(1), digits.eq(first), left.eq(self._steps - 1), by.eq(self.divisor)]

    @property
    def _above(self) -> Value:
        """Return the bits of half the divisor that do not lie below the dividend."""
        return self.divisor[1 + self._scale_bits :]

    @property
    def _halved(self) -> int:
        """Return how many of the dividend's lowest integer bits are those of half the divisor."""
        return min(self._zeros, self._integer_bits) if self._nearest and len(self._above) <= self._zeros else 0

    @property
    def _dividend(self) -> Value:
        """Return the dividend without `addend` and the bits below it."""
        above = self._above
        if not self._nearest:
            return self.dividend
        return Cat(above, self.dividend[len(above) :]) if len(above) <= self._zeros else self.dividend + above
