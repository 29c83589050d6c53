"""A divider finds a quotient bit by bit."""

from amaranth import Array, Cat, Const, Module, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class Divider(wiring.Component):
    """Divides serially, signed, non-restoring: gives ⌊2^s · dividend / divisor⌋, or the nearest integer to it.

    In each step the divisor is taken from the doubled remainder, or added if that is negative; so it stays within
    −divisor … divisor − 1. The signs that it passes through, inverted but for the first, are the digits of the quotient
    in two's complement: Σ ±2^i is their weighted sum, and the last one is the correction to a remainder that is not
    negative. The digits follow the dividend in its register, from which a bit goes to the remainder in each step. The
    nearest integer is ⌊(2^s · dividend + ⌊divisor/2⌋) / divisor⌋, whose dividend has the divisor's bits at its end: so
    nothing is to be added to the quotient. A counter shows when the last digit has come. It ends from any state, unlike
    a marker among the digits.

    Latency: `done` is high as many clocks after `start` as the quotient has bits, and one; a `start` before `done`, or
    together with it, begins the next division.

    Parameters
    ----------
    integer_bits : int
        Of the quotient, without its sign: the quotient has as many, and s and the sign.
    scale_bits : int
        s.
    nearest : bool
        Round to the nearest integer, a tie up.
    zeros : int
        Bits at the end of each dividend that are 0.

    Members
    -------
    start : In(1)
    dividend : In(signed(divisor_width + integer_bits + 1))
    divisor : In(divisor_width)
        Positive; both are valid with `start`.
    running : Out(1)
        A digit is found in this clock.
    digit : Out(1)
        The digits of the quotient in two's complement, the first ones first; the very first one is inverted.
    done : Out(1)
        One clock: the quotient is new.
    quotient : Out(signed(integer_bits + scale_bits + 1))
        Held until the next start.
    by : Out(divisor_width)
        The divisor, held until the next start.
    """

    def __init__(
        self, *, divisor_width: int, integer_bits: int, scale_bits: int, nearest: bool = False, zeros: int = 0
    ) -> None:
        self._steps = integer_bits + scale_bits
        self._scale_bits = scale_bits
        self._nearest = nearest
        self._zeros = zeros
        super().__init__(
            {
                "start": In(1),
                "dividend": In(signed(divisor_width + integer_bits + 1)),
                "divisor": In(divisor_width),
                "running": Out(1),
                "digit": Out(1),
                "done": Out(1),
                "quotient": Out(signed(self._steps + 1)),
                "by": Out(divisor_width),
            }
        )
        # Counts down to −1.
        self._left = Signal(signed((self._steps - 1).bit_length() + 1), name="left", reset_less=True)

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

    def elaborate(self, platform: object) -> Module:
        m = Module()
        # Only the flags of work in progress need a reset; all else is loaded before it is used.
        left, running = self._left, self.running
        remainder = Signal(signed(len(self.by) + 1), reset_less=True)
        digits = Signal(self._steps + 1, reset_less=True)
        by = Signal.like(self.by, reset_less=True)
        negative = remainder[-1]
        m.d.comb += [self.by.eq(by), self.digit.eq(~negative), self.quotient.eq(Cat(digits[:-1], ~digits[-1]))]
        # 2·remainder ± by with one adder: −by is ~by + 1, and the 1 comes from an additional bit at the adder's end.
        term = Cat(by, Const(0)) ^ (~negative).replicate(len(by) + 1)
        total = Cat(1, digits[-1], remainder).as_signed() + Cat(~negative, term).as_signed()
        m.d.sync += self.done.eq(running & left[-1] & ~self.start)
        with m.If(running):
            m.d.sync += [remainder.eq(total >> 1), digits.eq(Cat(self.digit, digits)), left.eq(left - 1)]
        with m.If(left[-1]):
            m.d.sync += running.eq(0)
        with m.If(self.start):
            m.d.sync += [
                running.eq(1),
                Cat(digits[1:], remainder).eq(self._scaled),
                left.eq(self._steps - 1),
                by.eq(self.divisor),
            ]
        return m

    @property
    def _scaled(self) -> Value:
        """The dividend."""
        scale, zeros = self._scale_bits, self._zeros
        if not self._nearest:
            return self.dividend << scale
        half = Cat(self.divisor[1:], Const(0, scale))
        above = half[scale : max(scale, len(self.divisor) - 1)]
        whole: Value = self.dividend + above
        if len(above) <= zeros:
            whole = Cat(above, Const(0, zeros - len(above)), self.dividend[zeros:])
        return Cat(half[:scale], whole)
