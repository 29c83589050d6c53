"""The remainder of a position by any number."""

from amaranth import C, Cat, Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.core import sampled


class Remainder(Box):
    """Divides a position bit by bit, from the highest on, and gives the remainder, 0 to N-1, of negative ones as well.

    The rest is doubled, takes the next bit, and gets less by the divisor if it can. The sign weighs -1: it is inverted,
    and the rest begins as -1/2, which is (divisor - 1)/2 modulo the divisor.

    Latency: `done` is high `form.clocks` clocks after `start`; `start` may come again with it.
    """

    def __init__(self, form: sampled.Remainder) -> None:
        self._form = form
        super().__init__(
            start=In(1),
            value=In(signed(form.width)),  # from the clock after `start` until `done`
            done=Out(1),
            remainder=Out(range(form.divisor << form.shift)),  # valid with `done`
        )

    def build(self, m: Module) -> None:
        form, value = self._form, self.value
        left = Signal(range(form.clocks + 1))
        digit = Signal()
        rest = Signal(range(form.divisor))
        total = Cat(digit, rest)
        less = Signal(signed(len(total) + 1))
        coming = Mux(less[-1], total, less)[: len(rest)]
        digits = Cat(C(0, 2), value[form.shift : -1], ~value[-1])
        m.d.comb += [less.eq(total - form.divisor), self.done.eq(left == 1)]
        m.d.comb += self.remainder.eq(Cat(value[: form.shift], coming))
        m.d.sync += [rest.eq(coming), digit.eq(digits.bit_select(left, 1))]
        with m.If(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.If(self.start):
            m.d.sync += [left.eq(form.clocks), total.eq(form.divisor // 2)]
