"""Against glitches."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out


class GlitchFilter(wiring.Component):
    """Passes a level when it has held for `clocks` consecutive clocks.

    Latency: a level that holds from clock c on is at the output in clock c + `clocks`.

    Parameters
    ----------
    clocks : int

    Members
    -------
    level : In(1)
    load : In(1)
        Take the level as it is: there is no past yet.
    filtered : Out(1)
    swallowed : Out(1)
        High for one clock when a level went back before it had held long enough; two edges are swallowed.

    Raises
    ------
    ValueError
        If `clocks` is less than 1.
    """

    def __init__(self, clocks: int) -> None:
        if clocks < 1:
            raise ValueError(f"clocks must be at least 1, not {clocks}")
        self._clocks = clocks
        super().__init__({"level": In(1), "load": In(1), "filtered": Out(1), "swallowed": Out(1)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        held = Signal(range(max(self._clocks, 2)))  # no signal is without a bit
        differs = self.level ^ self.filtered
        m.d.comb += self.swallowed.eq(~differs & held.any() & ~self.load)
        m.d.sync += held.eq(0)
        with m.If(self.load | (differs & (held == self._clocks - 1))):
            m.d.sync += self.filtered.eq(self.level)
        with m.Elif(differs):
            m.d.sync += held.eq(held + 1)
        return m
