"""base + N·(Q + R/m), rounded: the arithmetic for a reciprocal that comes as quotient and remainder.

It forms base·2^f + N·Q + ⌊N·R/m + ½⌋ exactly, or with the floor or the ceiling of N·R/m. The products grow by a bit of
N at a time, the least significant first, its sign bit negative. N·R/m is a small number, of no more bits than N: it is
found by as many subtractions of m, which leave a remainder of either sign (non-restoring), and one more rounds it.
"""

from amaranth import Cat, Const, Module, Value, signed
from amaranth.lib import data
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.scaled import scaled_stream
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.registers import registers
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal


def _reduce(remainder: Value, multiple: Value) -> Value:
    """Return remainder − multiple, or + multiple if it is negative: one adder, into which an additional bit carries."""
    subtract = ~remainder[-1]
    operand = Cat(subtract, multiple ^ subtract.replicate(len(multiple)), subtract).as_signed()
    return (Cat(1, remainder).as_signed() + operand) >> 1


def _rounded(total: Value, quotient: Value, up: Value) -> Value:
    """Return total + quotient, and one more if `up`: one adder."""
    return (Cat(1, total).as_signed() + Cat(up, quotient).as_signed()) >> 1


class RemainderScaler(Box):
    """Has a stage for every step: `start` may be high in every clock.

    Latency: a result comes as many clocks after `start` as N has bits and ⌊N·R/m⌋ has digits, and three more.

    - `tag`: What travels along with a value; `m` is a field of it.
    - `towards`: Round to the nearest (0), down (−1) or up (1).
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
            load=In(1),  # with `base` and `numerator`
            start=In(1),  # the clock after `load`, with `tag`
            base=In(signed(base_width)),
            numerator=In(signed(numerator_width)),
            tag=In(tag),
            q=In(reciprocal.quotient_width),  # quotient and remainder, valid in the clock after `start`
            r=In(reciprocal.remainder_width),
            results=Out(scaled_stream(base_width + reciprocal.frac_bits, tag)),  # held until the next
        )

    def build(self, m: Module) -> None:
        result = registers(self.results.p.shape(), "result")
        m.d.comb += self.results.p.eq(result)

        bits, base = delay(m, self.numerator, self.base)
        valid, bits, base, tag = delay(m, self.start, bits, base, self.tag)
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
        doubled = _reduce(remainder << 1, tag.m)  # twice the remainder, less m
        up = (~doubled[-1], doubled + tag.m != 0, Const(0))[self._towards]
        valid, tag, total, quotient, up = delay(m, valid, tag, total, quotient, up)
        m.d.sync += self.results.valid.eq(valid)
        with m.If(valid):
            m.d.sync += [result.quotient.eq(_rounded(total, quotient.as_signed(), up)), result.tag.eq(tag)]
