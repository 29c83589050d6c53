"""A number as a stream of bits."""

from amaranth import Cat, Module, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class SigmaDelta(Box):
    """First-order sigma-delta modulator: `current_pdm` is high in (value + 2^(width − 1)) of 2^width clocks.

    A pulse-width modulator would have a period that delays what it shows; this has none, its ripple is at higher
    frequencies, and it is one adder. Latency: a clock.
    """

    def __init__(self, width: int) -> None:
        super().__init__({"value": In(signed(width)), "current_pdm": Out(1)})

    def build(self, m: Module) -> None:
        left = Signal(len(self.value))
        # The inverted sign adds 2^(width − 1).
        m.d.sync += Cat(left, self.current_pdm).eq(left + Cat(self.value[:-1], ~self.value[-1]))
