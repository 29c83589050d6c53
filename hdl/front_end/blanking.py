"""Against echoes and bounce."""

from amaranth import Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.ports import Box


class Blanking(Box):
    """Holds the level of a line for `clocks` clocks after a change, then takes the level that the line has.

    Latency: none.

    - `clocks`: At least 2; a change that comes as late is taken again.
    - `starts`: Level whose changes are held; None for both.
    """

    def __init__(self, clocks: int, starts: int | None = None) -> None:
        if clocks < 2:
            raise ValueError(f"clocks must be at least 2, not {clocks}")
        self._clocks, self._starts = clocks, starts
        super().__init__(
            level=In(1),
            ready=In(1),  # low while the level before this one is not real: its change is none
            held=Out(1),
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time that is left; a simulation may move it on."""
        return (IdleCounter("left", -1, (0,)),)

    def build(self, m: Module) -> None:
        past = Signal()
        left = Signal(range(self._clocks))
        m.d.comb += self.held.eq(Mux(left.any(), past, self.level))
        m.d.sync += past.eq(self.held)
        starts = self.held ^ past if self._starts is None else (self.held ^ past) & (self.held == self._starts)
        with m.If(left.any()):
            m.d.sync += left.eq(left - 1)
        with m.Elif(self.ready & starts):
            m.d.sync += left.eq(self._clocks - 1)
