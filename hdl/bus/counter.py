"""A counter tells how often something happened."""

from amaranth import Module
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class SaturatingCounter(Box):
    """Counts the clocks of an event, and stays at its greatest value."""

    def __init__(self, width: int) -> None:
        super().__init__(
            event=In(1),
            clear=In(1),  # the count is 0 in the next clock, an event in this one included
            count=Out(width),  # events up to the clock before
        )

    def build(self, m: Module) -> None:
        m.d.sync += self.count.eq(self.count + (self.event & ~self.count.all()))
        with m.If(self.clear):
            m.d.sync += self.count.eq(0)
