"""base + N·q, rounded: the arithmetic that turns a reciprocal into a velocity.

All scalers form base·2^f + ⌊(N·q + C) / 2^k⌋, which spec/formats/reciprocal.py shows to be correctly rounded. Two are
serial: they take N in digits −2 … 2 of radix 4 (Booth), a clock for each. The pipelined one has an adder for every bit
of N, and accepts any update rate.
"""

from amaranth import Cat, Const, Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.scaled import scaled_stream
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.registers import registers
from tachometry.spec.formats.reciprocal import Reciprocal


class _Scaler(Box):
    """Holds the parts that all scalers share.

    - `towards`: Round to the nearest (0), down (−1) or up (1).
    """

    def __init__(
        self, reciprocal: Reciprocal, *, base_width: int, numerator_width: int, tag: data.StructLayout, towards: int = 0
    ) -> None:
        self._bits = numerator_width
        self._digits = reciprocal.digits
        self._is_odd = reciprocal.is_odd
        self._rounding = reciprocal.rounding(towards)
        self._frac_bits = reciprocal.frac_bits
        self._scale_bits = reciprocal.scale_bits
        super().__init__(
            load=In(1),  # with `base` and `numerator`
            start=In(1),  # the clock after `load`, with `q` and `tag`
            base=In(signed(base_width)),
            numerator=In(signed(numerator_width)),
            tag=In(tag),
            q=In(reciprocal.width),
            results=Out(scaled_stream(base_width + reciprocal.frac_bits, tag)),  # held until the next
        )


class _SerialScaler(_Scaler):
    """Takes a digit of N a clock.

    `q` and `tag` must stay as they are until the result. `start` may come again as soon as the result has.

    Latency: a result comes as many clocks after `start` as N has digits, and one more.
    """

    def build(self, m: Module) -> None:
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)
        run = Signal(self._digits)  # bit i: the product of the digit that comes after i others is added
        m.d.sync += [run.eq(Cat(self.start, run)), self.results.valid.eq(run[-1])]

        # A digit is told by two bits of N and the one below them.
        below, low, high = self._next_digit(m)
        twice = (high ^ low) & ~(low ^ below)
        # Its product with q; −q is ~q + 1. Of an odd q that is all bits but the last inverted.
        product = Cat(Mux(twice, self.q << 1, self.q) ^ high.replicate(len(self.q) + 1), high)
        if self._is_odd:
            product = Cat(Mux(twice, 0, 1), Mux(twice, 1, self.q[1]) ^ (high & ~twice), product[2:])
        addend = Signal(signed(len(product)), reset_less=True)
        carry = Signal(reset_less=True)
        m.d.sync += [addend.eq(product), carry.eq(0 if self._is_odd else high)]
        # The reset is the digit 0.
        with m.If((high == low) & (low == below)):
            m.d.sync += [addend.eq(0), carry.eq(0)]

        quotient = self._sum(m, run[:-1].any(), addend, carry)
        with m.If(run[-1]):
            m.d.sync += [result.quotient.eq(quotient), result.tag.eq(self.tag)]

    def _next_digit(self, m: Module) -> Value:
        """Return the two bits that tell a digit, and the one below first; another digit in every clock after `load`."""
        raise NotImplementedError

    def _sum(self, m: Module, adds: Value, addend: Value, carry: Value) -> Value:
        """Return the quotient from the sum of all products, of which `addend` and `carry` are the last.

        Where `adds` is high, they are added to what is kept.
        """
        raise NotImplementedError


class SerialScaler(_SerialScaler):
    """Takes a digit of N a clock, the greatest first, with one adder."""

    def _next_digit(self, m: Module) -> Value:
        digits = Signal(signed(2 * self._digits), reset_less=True)
        m.d.sync += digits.eq(digits << 2)
        with m.If(self.load):
            m.d.sync += digits.eq(self.numerator)
        return Cat(digits[-3] if self._digits > 1 else 0, digits[-2:])

    def _sum(self, m: Module, adds: Value, addend: Value, carry: Value) -> Value:
        # The sum begins without the low bits of what rounds: two of them come with every digit.
        shifted_in = self._rounding & 2
        begin = self._rounding >> (2 * self._digits)
        assert self._rounding == (begin << 2 * self._digits) + shifted_in * ((1 << 2 * self._digits) - 1) // 3
        low_bits = self._frac_bits + self._scale_bits - 2 * self._digits
        total = Signal(signed(len(self.results.p.quotient) + self._scale_bits))
        part = Signal(signed(len(total) - 2), reset_less=True)
        low = Cat(carry, shifted_in >> 1)
        free = 0 if not self._is_odd else 1 if shifted_in else 2  # low bits to which nothing is added
        m.d.comb += total.eq(Cat(addend[:free], Cat(low[free:], part).as_signed() + addend[free:].as_signed()))
        with m.If(adds):
            m.d.sync += part.eq(total)
        with m.If(self.load):
            m.d.sync += part.eq(Cat(Const(begin, low_bits), self.base).as_signed())
        return total >> self._scale_bits


class WideSerialScaler(_SerialScaler):
    """Takes a digit of N a clock, the least significant first, with two adders.

    The sum moves down by two bits with each digit. So what the lower adder carries can wait for a clock: it is added to
    the two bits that move down then. All bits of the result but two come from the lower adder. q must be odd.
    """

    def _next_digit(self, m: Module) -> Value:
        digits = Signal(signed(self._bits + 1), reset_less=True)
        m.d.sync += digits.eq(digits >> 2)
        with m.If(self.load):
            m.d.sync += digits.eq(self.numerator << 1)
        return digits[:3]

    def _sum(self, m: Module, adds: Value, addend: Value, carry: Value) -> Value:
        low_bits = self._scale_bits - 2 * self._digits  # of the last sum, once it has moved down
        n_lower = low_bits + len(self.results.p.quotient)
        first = Cat(Const(self._rounding, self._frac_bits + self._scale_bits), self.base).as_signed()
        n_upper = len(first) + 1 - n_lower
        lower = Signal(n_lower - 2, reset_less=True)
        upper = Signal(signed(n_upper + 2), reset_less=True)
        waits = Signal(reset_less=True)
        between, carried = _increment(upper[:2], waits)
        lower_sum = Signal(n_lower + 1)
        upper_sum = Signal(signed(n_upper))
        m.d.comb += [
            lower_sum.eq(Cat(lower, between) + addend[:n_lower]),
            upper_sum.eq((Cat(carried, upper[2:]).as_signed() + Cat(carried, addend[n_lower:]).as_signed()) >> 1),
        ]
        with m.If(adds):
            m.d.sync += [lower.eq(lower_sum[2:n_lower]), waits.eq(lower_sum[-1]), upper.eq(upper_sum)]
        with m.If(self.load):
            m.d.sync += [lower.eq(first), waits.eq(0), upper.eq(first[n_lower - 2 :].as_signed())]
        top, _ = _increment(upper_sum[:2], lower_sum[-1])
        return Cat(lower_sum[2 + low_bits : n_lower], top)


def _increment(bits: Value, by: Value) -> tuple[Value, Value]:
    """Return two bits with another one added, and what is carried: without an adder, whose chain would be longer."""
    return Cat(bits[0] ^ by, bits[1] ^ (bits[0] & by)), bits[0] & bits[1] & by


class PipelinedScaler(_Scaler):
    """Has an adder for every bit of N, the least significant first: `start` may be high in every clock.

    Latency: a result comes as many clocks after `start` as N has bits, and one more.
    """

    def build(self, m: Module) -> None:
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)

        bits, base = delay(m, self.numerator, self.base)
        valid, tag, q = self.start, self.tag, self.q
        total: ValueLike = self._rounding
        for step in range(self._bits):
            sum_ = Signal(signed(len(self.q) + 1))
            last = step == self._bits - 1
            # A bit of the sum is dropped for every bit of N.
            m.d.sync += sum_.eq(Mux(bits[step], total - q if last else total + q, total) >> 1)
            total = sum_
            valid, bits, base, tag, q = delay(m, valid, bits, base, tag, q)
        m.d.sync += self.results.valid.eq(valid)
        with m.If(valid):
            left = Value.cast(total >> (self._scale_bits - self._bits))[: len(result.quotient)].as_signed()
            m.d.sync += [result.quotient.eq((base << self._frac_bits) + left), result.tag.eq(tag)]
