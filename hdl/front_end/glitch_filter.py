"""Against glitches."""

from amaranth import Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.ports import Box


class GlitchFilter(Box):
    """Passes a level when it has held for `clocks` consecutive clocks.

    Until the first level has held for so long, nothing is known of the line.

    Latency: a level that holds from clock c on is at the output in clock c + `clocks`.

    It raises ValueError if `clocks` is less than 1.
    """

    def __init__(self, clocks: int) -> None:
        if clocks < 1:
            raise ValueError(f"clocks must be at least 1, not {clocks}")
        self._clocks = clocks
        super().__init__(
            level=In(1),
            valid=In(1),  # the level is one of the line
            filtered=Out(1),
            known=Out(1),  # `filtered` is a level that has held long enough
            swallowed=Out(1),  # one clock: a level went back before it had held long enough, with two edges
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time that a level has held; a simulation may move it on."""
        return (IdleCounter("held", 1, (self._clocks - 1,)),)

    def build(self, m: Module) -> None:
        held = Signal(range(max(self._clocks, 2)))  # no signal is without a bit
        differs = self.level ^ self.filtered
        first = int(self._clocks > 1)  # clocks that a first level has held with its first, if these are not enough
        m.d.comb += self.swallowed.eq(~differs & held.any() & self.known)
        # The first level is what stays the same for so long, and all others are what differs for so long.
        with m.If(self.valid):
            with m.If(differs != self.known):
                m.d.sync += held.eq(Mux(self.known, 0, first))
                with m.If(~self.known):
                    m.d.sync += [self.filtered.eq(self.level), self.known.eq(not first)]
            with m.Elif(held == self._clocks - 1):
                m.d.sync += [self.filtered.eq(self.level), self.known.eq(1), held.eq(0)]
            with m.Else():
                m.d.sync += held.eq(held + 1)
