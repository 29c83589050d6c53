"""The product that all terms of the controller share."""

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class _Product(Box):
    """round(word · factor / 2^p).

    - `factor_bits`: p.
    """

    def __init__(self, word_width: int, factor_bits: int) -> None:
        super().__init__(
            start=In(1),
            word=In(signed(word_width)),  # from `start` on, until `done`
            factor=In(factor_bits),  # with `start`
            done=Out(1),  # one clock: the product is valid
            product=Out(signed(word_width)),
        )


class SerialProduct(_Product):
    """A bit of the factor a clock, the lowest first: `done` is high p + 1 clocks after `start`."""

    def build(self, m: Module) -> None:
        bits = len(self.factor)
        factor = Signal(bits, reset_less=True)
        total = Signal(signed(len(self.word)), reset_less=True)
        left = Signal(range(bits), reset_less=True)
        running = Signal()
        last = Signal()
        m.d.comb += self.product.eq(total)
        # What is left of the point rounds: one more in the last addition, from an additional bit at the adder's end.
        addend = Cat(last, Mux(factor[0], self.word, 0)).as_signed()
        m.d.sync += [last.eq(running & (left == 1)), self.done.eq(last)]
        with m.If(running):
            m.d.sync += [total.eq((Cat(1, total).as_signed() + addend) >> 2), factor.eq(factor >> 1), left.eq(left - 1)]
        with m.If(last):
            m.d.sync += running.eq(0)
        with m.If(self.start):
            m.d.sync += [running.eq(1), total.eq(0), factor.eq(self.factor), left.eq(bits - 1)]


class ParallelProduct(_Product):
    """At once, with a register behind each step: `done` is high 3 clocks after `start`."""

    def build(self, m: Module) -> None:
        bits = len(self.factor)
        factor = Signal(bits, reset_less=True)
        whole = Signal(signed(len(self.word) + bits + 1), reset_less=True)
        product = Signal.like(self.product, reset_less=True)
        started = Signal()
        multiplied = Signal()
        m.d.sync += [
            factor.eq(self.factor),
            whole.eq(self.word * factor),
            product.eq((whole + (1 << (bits - 1))) >> bits),
            started.eq(self.start),
            multiplied.eq(started),
            self.done.eq(multiplied),
        ]
        m.d.comb += self.product.eq(product)
