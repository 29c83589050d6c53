"""Which axis has the datapath."""

from amaranth import Cat, Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box


class Turns(Box):
    """Gives the datapath to one axis after the other, for some clocks each.

    After reset each has a turn before any tick: the datapath has nothing else to do, and clears its memory.
    """

    def __init__(self, axes: int, cycles: int) -> None:
        self._axes = axes
        super().__init__(
            begin=In(1),  # the first turn begins in the next clock; not before the last one has ended
            axis=Out(range(max(axes, 2))),  # that has its turn
            clears=Out(1, init=1),  # it is a turn after reset
            step=Out(cycles, init=1),  # bit n in the n-th clock of a turn
        )

    def build(self, m: Module) -> None:
        final = Signal()
        ends = self.step[-1]
        m.d.comb += final.eq(self.axis == self._axes - 1)
        m.d.sync += self.step.eq(Cat(ends & ~final, self.step))
        with m.If(ends):
            m.d.sync += self.axis.eq(self.axis + 1)
            with m.If(final):
                m.d.sync += [self.axis.eq(0), self.clears.eq(0)]
        # Whatever an upset has left ends here.
        with m.If(self.begin):
            m.d.sync += [self.step.eq(1), self.axis.eq(0)]
