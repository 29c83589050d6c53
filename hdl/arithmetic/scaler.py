"""base + N·q, rounded: the arithmetic that turns a reciprocal into a velocity.

Both scalers form base·2^f + ⌊(N·q + E + 2^(k−1)) / 2^k⌋, which spec/formats/reciprocal.py shows to be correctly
rounded, by adding q for every bit of N, the least significant first, and dropping a bit of the sum each time; the sign
bit of N counts negative. One scaler takes a clock per bit and a single adder. The other has an adder per bit, and
accepts any update rate. Their latencies are the same.
"""

from amaranth import Cat, Module, Mux, Signal, Value, ValueLike, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.delay import delay
from tachometry.hdl.arithmetic.registers import registers
from tachometry.hdl.arithmetic.scaled import scaled_stream
from tachometry.spec.formats.reciprocal import Reciprocal


class _Scaler(wiring.Component):
    """What both scalers share.

    Latency: a result comes as many clocks after `start` as N has bits, and three more.

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
        `base`, `numerator` and `tag` are valid.
    start : In(1)
        The loaded values are to be used; only together with `load`.
    base, numerator, tag : In
    q : In(reciprocal.width)
        Reciprocal, valid in the clock after `start`.
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
        self._steps = numerator_width
        self._rounding = reciprocal.rounding(towards)
        self._frac_bits = reciprocal.frac_bits
        # What is left to drop when all bits of N are done.
        self._surplus = reciprocal.scale_bits - numerator_width
        self._total_shape = signed(reciprocal.width + 1)
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

    def _result(self, base: Signal, total: Signal) -> ValueLike:
        """The quotient, from a total of which a bit has been dropped for every bit of N."""
        width = len(self.results.p.quotient)
        # Both terms may be taken modulo the width of the sum, which is known to fit.
        return (base << self._frac_bits) + Value.cast(total >> self._surplus)[:width].as_signed()


class SerialScaler(_Scaler):
    """One bit of N a clock. `load` may come again as soon as the result has."""

    def elaborate(self, platform: object) -> Module:
        m = Module()
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)
        # Only the flags of work in progress need a reset; all else is loaded before it is used.
        running = Signal()
        adding = Signal()
        last = Signal()
        added = Signal()
        total = Signal(self._total_shape, reset_less=True)
        bits = Signal(self._steps, reset_less=True)
        step = Signal(range(self._steps + 1), reset_less=True)
        base = Signal.like(self.base, reset_less=True)
        tag = Signal.like(self.tag, reset_less=True)

        # What is added next: q, nothing where a bit of N is 0, −q = ~q + 1 where its sign bit is 1.
        sign = step == self._steps - 1
        addend = Signal.like(self.q, reset_less=True)
        borrow = Signal(reset_less=True)
        m.d.sync += [
            addend.eq(self.q ^ sign.replicate(len(self.q))),
            borrow.eq(sign & bits[0]),
            bits.eq(bits >> 1),
            adding.eq(running),
            last.eq(running & sign),
            added.eq(last),
            self.results.valid.eq(added),
        ]
        with m.If(running):
            m.d.sync += step.eq(step + 1)
        with m.If(~bits[0]):
            m.d.sync += addend.eq(0)
        with m.If(sign):
            m.d.sync += running.eq(0)
        with m.If(adding):
            # The carry into the adder comes from an additional bit at its end.
            sum_ = Cat(1, total).as_signed() + Cat(borrow, addend, borrow).as_signed()
            m.d.sync += total.eq(sum_ >> 2)
        with m.If(added):
            m.d.sync += [result.quotient.eq(self._result(base, total)), result.tag.eq(tag)]
        with m.If(self.load):
            m.d.sync += [
                total.eq(self._rounding),
                bits.eq(self.numerator),
                step.eq(0),
                base.eq(self.base),
                tag.eq(self.tag),
                running.eq(self.start),
            ]
        return m


class PipelinedScaler(_Scaler):
    """An adder for every bit of N: `start` may be high in every clock."""

    def elaborate(self, platform: object) -> Module:
        m = Module()
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)

        valid, bits, base, tag = delay(m, self.start, self.numerator, self.base, self.tag)
        valid, bits, base, tag, q = delay(m, valid, bits, base, tag, self.q)
        total: ValueLike = self._rounding
        for step in range(self._steps):
            sum_ = Signal(self._total_shape)
            last = step == self._steps - 1
            m.d.sync += sum_.eq(Mux(bits[step], total - q if last else total + q, total) >> 1)
            total = sum_
            valid, bits, base, tag, q = delay(m, valid, bits, base, tag, q)
        m.d.sync += self.results.valid.eq(valid)
        with m.If(valid):
            m.d.sync += [result.quotient.eq(self._result(base, total)), result.tag.eq(tag)]
        return m
