"""base + N·q, rounded: the arithmetic that turns a reciprocal into a velocity.

Both scalers form ⌊(base·2^(f+k) + N·q + E + 2^(k−1)) / 2^k⌋, which spec/reciprocal.py shows to be correctly rounded, by
adding q for every bit of N, the least significant first, and dropping a bit of the sum each time; the sign bit of N
counts negative and is subtracted. The one takes a clock per bit and a single adder, the other an adder per bit and any
update rate. Their latency is the same.
"""

from amaranth import Cat, Module, Mux, Signal, ValueLike, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.reciprocal import Reciprocal


class _Scaler(wiring.Component):
    """What both scalers share.

    Latency: `done` is high as many clocks after `start` as N has bits, and two more.

    Parameters
    ----------
    reciprocal : spec.reciprocal.Reciprocal
    base_width, numerator_width : int
        Bits of `base` and `numerator`, both signed.
    tag_width : int
        Bits that travel along with a value.

    Members
    -------
    start : In(1)
    base, numerator, tag : In
        Valid with `start`.
    q : In(reciprocal.width)
        Reciprocal, valid in the clock after `start`.
    done : Out(1)
    velocity, tag_out : Out
        Valid with `done`, and held until the next.
    """

    def __init__(self, reciprocal: Reciprocal, *, base_width: int, numerator_width: int, tag_width: int) -> None:
        self._reciprocal = reciprocal
        self._steps = numerator_width
        self._sum_shape = signed(reciprocal.frac_bits + reciprocal.scale_bits + base_width)
        # Where the integer part begins, and what is left to drop when all bits of N are done.
        self._point = reciprocal.frac_bits + reciprocal.scale_bits
        self._surplus = reciprocal.scale_bits - numerator_width
        super().__init__(
            {
                "start": In(1),
                "base": In(signed(base_width)),
                "numerator": In(signed(numerator_width)),
                "tag": In(tag_width),
                "q": In(reciprocal.width),
                "done": Out(1),
                "velocity": Out(signed(base_width + reciprocal.frac_bits)),
                "tag_out": Out(tag_width),
            }
        )

    def _initial(self) -> ValueLike:
        return (self.base << self._point) | self._reciprocal.rounding

    def _result(self, total: ValueLike) -> ValueLike:
        """Floor of a total from which a bit has been dropped for every bit of N."""
        return total >> self._surplus


class SerialScaler(_Scaler):
    """One bit of N a clock. `start` may come again as soon as `done` has."""

    def elaborate(self, platform: object) -> Module:
        m = Module()
        total = Signal(self._sum_shape)
        bits = Signal(self._steps)
        step = Signal(range(self._steps + 1))
        running, adding, last = Signal(), Signal(), Signal()
        tag = Signal.like(self.tag)

        # What is added next: q, nothing where a bit of N is 0, −q = ~q + 1 where its sign bit is 1.
        sign = step == self._steps - 1
        addend = Signal.like(self.q)
        borrow = Signal()
        m.d.sync += [
            addend.eq(self.q ^ sign.replicate(len(self.q))),
            borrow.eq(sign & bits[0]),
            bits.eq(bits >> 1),
            adding.eq(running),
            last.eq(sign),
        ]
        with m.If(~bits[0]):
            m.d.sync += addend.eq(0)
        with m.If(running):
            m.d.sync += step.eq(step + 1)

        shifted = (total + Cat(addend, borrow).as_signed() + borrow)[1:].as_signed()
        with m.If(adding):
            m.d.sync += total.eq(shifted)
        m.d.sync += self.done.eq(adding & last)
        with m.If(adding & last):
            m.d.sync += [
                running.eq(0),
                adding.eq(0),
                self.velocity.eq(self._result(shifted)),
                self.tag_out.eq(tag),
            ]
        with m.If(self.start):
            m.d.sync += [
                total.eq(self._initial()),
                bits.eq(self.numerator),
                step.eq(0),
                tag.eq(self.tag),
                running.eq(1),
            ]
        return m


class PipelinedScaler(_Scaler):
    """An adder for every bit of N: `start` may be high in every clock."""

    def elaborate(self, platform: object) -> Module:
        m = Module()

        def delay(value: ValueLike) -> Signal:
            register = Signal.like(value)
            m.d.sync += register.eq(value)
            return register

        valid, bits, tag = delay(self.start), delay(self.numerator), delay(self.tag)
        total = Signal(self._sum_shape)
        m.d.sync += total.eq(self._initial())
        valid, bits, tag, total, q = delay(valid), delay(bits), delay(tag), delay(total), delay(self.q)
        for step in range(self._steps):
            last = step == self._steps - 1
            shifted = Mux(bits[0], total - q if last else total + q, total) >> 1
            if last:
                m.d.sync += self.done.eq(valid)
                with m.If(valid):
                    m.d.sync += [self.velocity.eq(self._result(shifted)), self.tag_out.eq(tag)]
            else:
                valid, bits, tag, q = delay(valid), delay(bits[1:]), delay(tag), delay(q)
                total = delay(shifted)
        return m
