"""base + N·q, rounded: the arithmetic that turns a reciprocal into a velocity.

Both scalers form base·2^f + ⌊(N·q + C) / 2^k⌋, which spec/formats/reciprocal.py shows to be correctly rounded. One
takes N in digits −2 … 2 of radix 4 (Booth), the greatest first, a clock for each, with a single adder. The other has an
adder for every bit of N, and accepts any update rate.
"""

from amaranth import Cat, Const, Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.delay import delay
from tachometry.hdl.arithmetic.registers import registers
from tachometry.hdl.arithmetic.scaled import scaled_stream
from tachometry.spec.formats.reciprocal import Reciprocal


class _Scaler(wiring.Component):
    """What both scalers share.

    Parameters
    ----------
    reciprocal : spec.reciprocal.Reciprocal
    base_width, numerator_width : int
        Bits of `base` and `numerator`, both signed.
    tag : data.StructLayout
        What travels along with a value.
    towards : int
        Round to the nearest (0), down (−1) or up (1).

    Members
    -------
    load : In(1)
        `base` and `numerator` are valid.
    start : In(1)
        What was loaded in the clock before is to be used; `q` and `tag` are valid.
    base, numerator, tag : In
    q : In(reciprocal.width)
        Reciprocal.
    results : Out(stream)
        `quotient` and `tag`, held until the next.
    """

    def __init__(
        self,
        reciprocal: Reciprocal,
        *,
        base_width: int,
        numerator_width: int,
        tag: data.StructLayout,
        towards: int = 0,
    ) -> None:
        self._bits = numerator_width
        self._digits = reciprocal.digits
        self._rounding = reciprocal.rounding(towards)
        self._frac_bits = reciprocal.frac_bits
        self._scale_bits = reciprocal.scale_bits
        super().__init__(
            {
                "load": In(1),
                "start": In(1),
                "base": In(signed(base_width)),
                "numerator": In(signed(numerator_width)),
                "tag": In(tag),
                "q": In(reciprocal.width),
                "results": Out(scaled_stream(base_width + reciprocal.frac_bits, tag)),
            }
        )


class SerialScaler(_Scaler):
    """A digit of N a clock.

    `q` and `tag` must stay as they are until the result. `start` may come again as soon as the result has.

    Latency: a result comes as many clocks after `start` as N has digits, and one more.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)
        n_digits = self._digits
        run = Signal(n_digits)  # bit i: the product of digit i is added, the greatest being digit 0
        m.d.sync += [run.eq(Cat(self.start, run)), self.results.valid.eq(run[-1])]

        # A digit is told by two bits of N and the one below them.
        digits = Signal(signed(2 * n_digits), reset_less=True)
        m.d.sync += digits.eq(digits << 2)
        with m.If(self.load):
            m.d.sync += digits.eq(self.numerator)
        below, low, high = digits[-3] if n_digits > 1 else Const(0, 1), digits[-2], digits[-1]
        twice = (high ^ low) & ~(low ^ below)
        # Its product with q; −q is ~q + 1. The reset is the digit 0.
        addend = Signal(signed(len(self.q) + 2), reset_less=True)
        carry = Signal(reset_less=True)
        product = Mux(twice, self.q << 1, self.q)
        m.d.sync += [addend.eq(Cat(product ^ high.replicate(len(product)), high).as_signed()), carry.eq(high)]
        with m.If((high == low) & (low == below)):
            m.d.sync += [addend.eq(0), carry.eq(0)]

        # The sum begins without the low bits of what rounds: two of them come with every digit, 0 where the carry is.
        shifted_in = self._rounding & 2
        begin = self._rounding >> (2 * n_digits)
        assert self._rounding == (begin << 2 * n_digits) + shifted_in * ((1 << 2 * n_digits) - 1) // 3
        low_bits = self._frac_bits + self._scale_bits - 2 * n_digits
        total = Signal(signed(len(result.quotient) + self._scale_bits))
        part = Signal(signed(len(total) - 2), reset_less=True)
        m.d.comb += total.eq(Cat(carry, Const(shifted_in >> 1, 1), part).as_signed() + addend)
        with m.If(run[:-1].any()):
            m.d.sync += part.eq(total)
        with m.If(self.load):
            m.d.sync += part.eq(Cat(Const(begin, low_bits), self.base).as_signed())
        with m.If(run[-1]):
            m.d.sync += [result.quotient.eq(total >> self._scale_bits), result.tag.eq(self.tag)]
        return m


class PipelinedScaler(_Scaler):
    """An adder for every bit of N, the least significant first: `start` may be high in every clock.

    Latency: a result comes as many clocks after `start` as N has bits, and one more.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()
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
        return m
