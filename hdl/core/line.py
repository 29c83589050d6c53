"""The line of an emulated encoder bounces and drops pulses."""

from amaranth import Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec.registers.emulator import BOUNCE_WIDTH


class EmulatedLine(Box):
    """Leaves edges out, and lets the line bounce after the others.

    Latency: two clocks.
    """

    def __init__(self, *, whole: bool = False) -> None:
        super().__init__(
            ideal=In(1),  # the line as it should be
            drop=In(1),  # an edge in this clock is left out: the line keeps its level until the next edge
            bounce=In(BOUNCE_WIDTH),  # clocks for which the line bounces
            random=In(1),  # whether a line that bounces has the wrong level
            noise=In(1),  # the line has the wrong level
            broken=In(1),
            line=Out(1),
            **only_if(whole, whole=Out(1)),  # the line as it would be if it were not broken
        )

    def build(self, m: Module) -> None:
        before = Signal()
        level = Signal()
        left = Signal(BOUNCE_WIDTH)
        whole = level ^ (left.any() & self.random) ^ self.noise
        m.d.sync += [before.eq(self.ideal), left.eq(Mux(left == 0, 0, left - 1)), self.line.eq(whole | self.broken)]
        if "whole" in self.signature.members:
            m.d.sync += self.whole.eq(whole)
        with m.If((self.ideal ^ before) & ~self.drop):
            m.d.sync += [level.eq(self.ideal), left.eq(self.bounce)]
