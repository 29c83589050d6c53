"""Against wires that are open."""

from amaranth import Module, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.ports import Box


class OpenCircuit(Box):
    """Pulse when a line has equalled its complement for longer than `clocks`, once until they differ again.

    - `clear`: What lasts is told again.
    - `open`: High in clock c + `clocks` if they have been equal from clock c on.
    """

    def __init__(self, clocks: int) -> None:
        self._clocks = clocks
        super().__init__({"equal": In(1), "clear": In(1), "open": Out(1)})

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time for which they have been equal; a simulation may move it on."""
        return (IdleCounter("since", 1, (self._clocks, self._clocks + 1)),)

    def build(self, m: Module) -> None:
        since = Signal(range(self._clocks + 2))
        m.d.comb += self.open.eq(self.equal & (since == self._clocks))
        with m.If(~self.equal | self.clear):
            m.d.sync += since.eq(0)
        with m.Elif(since <= self._clocks):
            m.d.sync += since.eq(since + 1)
