"""base + N·(Q + R/m), rounded: the arithmetic for a reciprocal that comes as quotient and remainder.

Both scalers form base·2^f + N·Q + ⌊N·R/m + ½⌋ exactly, or with the floor or the ceiling of N·R/m. The products grow by
a bit of N at a time, the least significant first, its sign bit negative. N·R/m is a small number, of no more bits than
N: it is found by as many subtractions of m, which leave a remainder of either sign (non-restoring), and one more rounds
it. One scaler does a step per clock with one pair of adders. The other does all steps in parallel, for any update rate.
"""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.delay import delay
from tachometry.hdl.arithmetic.registers import registers
from tachometry.hdl.arithmetic.scaled import scaled_stream
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal


def _reduce(remainder: Value, multiple: Value) -> Value:
    """remainder − multiple, or + multiple if it is negative: one adder, into which an additional bit carries."""
    subtract = ~remainder[-1]
    operand = Cat(subtract, multiple ^ subtract.replicate(len(multiple)), subtract).as_signed()
    return (Cat(1, remainder).as_signed() + operand) >> 1


def _rounded(total: Value, quotient: Value, up: Value) -> Value:
    """total + quotient, and one more if `up`: one adder."""
    return (Cat(1, total).as_signed() + Cat(up, quotient).as_signed()) >> 1


class _RemainderScaler(wiring.Component):
    """What both scalers share.

    Parameters
    ----------
    reciprocal : spec.carried_reciprocal.CarriedReciprocal
    base_width, numerator_width : int
        Bits of `base` and `numerator`, both signed.
    tag : data.StructLayout
        What travels along with a value; `m` is a field of it.
    towards : int
        Round to the nearest (0), down (−1) or up (1).

    Members
    -------
    load : In(1)
        `base`, `numerator` and `tag` are valid.
    start : In(1)
        The loaded values are to be used; only together with `load`.
    base, numerator, tag : In
    q, r : In
        Quotient and remainder, valid in the clock after `start`.
    results : Out(stream)
        `quotient` and `tag`, held until the next.
    """

    def __init__(
        self,
        reciprocal: CarriedReciprocal,
        *,
        base_width: int,
        numerator_width: int,
        tag: data.StructLayout,
        towards: int = 0,
    ) -> None:
        self._towards = towards
        self._frac_bits = reciprocal.frac_bits
        self._steps = numerator_width
        self._digits = reciprocal.digits
        super().__init__(
            {
                "load": In(1),
                "start": In(1),
                "base": In(signed(base_width)),
                "numerator": In(signed(numerator_width)),
                "tag": In(tag),
                "q": In(reciprocal.quotient_width),
                "r": In(reciprocal.remainder_width),
                "results": Out(scaled_stream(base_width + reciprocal.frac_bits, tag)),
            }
        )

    def _up(self, doubled: Value, m: Value) -> Value:
        """Whether ⌊N·R/m⌋ must be increased by one; `doubled` is twice its remainder, less m."""
        nearest = ~doubled[-1]
        return (nearest, doubled + m != 0, Const(0))[self._towards]


class PipelinedRemainderScaler(_RemainderScaler):
    """A stage for every step: `start` may be high in every clock.

    Latency: a result comes as many clocks after `start` as N has bits and ⌊N·R/m⌋ has digits, and three more.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)

        valid, bits, base, tag = delay(m, self.start, self.numerator, self.base, self.tag)
        q, r = self.q, self.r
        total = (base << self._frac_bits) + (q & bits[0].replicate(len(q)))
        product = Cat(r & bits[0].replicate(len(r)), 0).as_signed()
        for step in range(1, self._steps):
            step_q, step_r = delay(m, q, r, only_if=bits[step])
            valid, bits, tag, total, product, q, r = delay(m, valid, bits, tag, total, product, q, r)
            if step < self._steps - 1:
                total, product = total + (step_q << step), product + (step_r << step)
            else:
                total, product = total - (step_q << step), product - (step_r << step)
            total = total[
                : len(self.results.p.quotient)
            ].as_signed()  # all is modulo the width of the result, which fits

        valid, tag, total, remainder = delay(m, valid, tag, total, product)
        quotient = remainder[-1]  # its digits, the sign first
        for place in reversed(range(self._digits)):
            divisor = tag.m << place
            valid, tag, total, quotient, remainder = delay(
                m, valid, tag, total, quotient, _reduce(remainder, divisor)[: len(r) + place + 1].as_signed()
            )
            quotient = Cat(~remainder[-1], quotient)
        up = self._up(_reduce(remainder << 1, tag.m), tag.m)
        valid, tag, total, quotient, up = delay(m, valid, tag, total, quotient, up)
        m.d.sync += self.results.valid.eq(valid)
        with m.If(valid):
            m.d.sync += [
                result.quotient.eq(_rounded(total, quotient.as_signed(), up)),
                result.tag.eq(tag),
            ]
        return m


class SerialRemainderScaler(_RemainderScaler):
    """A step a clock. `load` may come again as soon as the result has.

    Latency: a result comes twice as many clocks after `start` as N has bits, and four more.
    """

    def elaborate(self, platform: object) -> Module:
        m = Module()
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)
        # Only the flags of work in progress need a reset; all else is loaded before it is used.
        running = Signal()
        step = Signal(range(2 * self._steps + 4), reset_less=True)
        tag = Signal.like(self.tag, reset_less=True)
        # Two products, each above and, what the shifts have brought there, below.
        total = Signal(signed(len(self.results.p.quotient) + 1), reset_less=True)
        total_low = Signal(self._steps, reset_less=True)
        remainder = Signal(signed(len(self.r) + 1), reset_less=True)
        low = Signal(self._steps, reset_less=True)  # N goes out at its low end, and the quotient comes in after it

        sign = step == self._steps - 1
        multiplied = Signal(reset_less=True)
        dividing = Signal(reset_less=True)
        divided = Signal(reset_less=True)
        with m.If(sign):
            m.d.sync += multiplied.eq(1)
        m.d.sync += [step.eq(step + 1), dividing.eq(multiplied), divided.eq(dividing)]

        # What is added next, nothing where a bit of N is 0, and subtracted for its sign: −q = ~q + 1.
        step_q = Signal.like(self.q, reset_less=True)
        step_r = Signal.like(self.r, reset_less=True)
        borrow = Signal(reset_less=True)
        m.d.sync += [
            step_q.eq(self.q ^ sign.replicate(len(self.q))),
            step_r.eq(Mux(multiplied, tag.m, self.r)),
            borrow.eq(sign & low[0]),
        ]
        with m.If(~multiplied & ~low[0]):
            m.d.sync += [step_q.eq(0), step_r.eq(0)]

        # The carry into an adder comes from an additional bit at its end.
        subtract = Mux(dividing, ~remainder[-1], borrow)
        left = Mux(dividing, Cat(low[-1], remainder).as_signed(), remainder)
        right = Cat(subtract, step_r ^ subtract.replicate(len(step_r)), subtract).as_signed()
        sum_r = (Cat(1, left).as_signed() + right) >> 1
        sum_q = (Cat(1, total).as_signed() + Cat(borrow, step_q, borrow).as_signed()) >> 1
        with m.If(dividing):
            # The sign of a remainder is a digit of the quotient.
            m.d.sync += [remainder.eq(sum_r), low.eq(Cat(divided & ~remainder[-1], low))]
        with m.Else():
            m.d.sync += [
                Cat(low, remainder).eq(Cat(low[1:], sum_r)),
                Cat(total_low, total).eq(Cat(total_low[1:], sum_q)),
            ]

        up = self._up(remainder, tag.m)
        last = running & (step == 2 * self._steps + 2)
        m.d.sync += self.results.valid.eq(last)
        with m.If(last):
            m.d.sync += [
                running.eq(0),
                result.quotient.eq(_rounded(Cat(total_low, total).as_signed(), low.as_signed(), up)),
                result.tag.eq(tag),
            ]
        with m.If(self.load):
            m.d.sync += [
                running.eq(self.start),
                step.eq(0),
                Cat(multiplied, dividing, divided).eq(0),
                tag.eq(self.tag),
                total.eq(self.base << (self._frac_bits + 1)),
                remainder.eq(0),
                low.eq(self.numerator),
                Cat(step_q, step_r, borrow).eq(0),
            ]
        return m
