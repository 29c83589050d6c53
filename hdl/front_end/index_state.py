"""The index in one state of the lines."""

from collections.abc import Sequence

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.spec.core.sensors import Levels, packed_levels


class IndexState(wiring.Component):
    """Lets the index Z through in one state of the lines alone, which is one place of a period in both directions.

    An index that is wider than a period meets the state twice. So Z that stays high while the lines leave the state on
    one side, and come back to it from the other, is reported; of a single line, that they come back at all.

    Latency: none of `index`; `index_wide` is high `latency` clocks after the state has come back.

    Parameters
    ----------
    state, after : tuple of int
        The levels of the lines, and those that follow them forward.

    Members
    -------
    level : In
        Levels of the lines, the first lowest.
    level_z : In(1)
    ready : In(1)
        All levels, and those of the clock before, are real.
    index : Out(1)
    index_wide : Out(1)
    """

    def __init__(self, state: Levels, after: Levels, latency: int) -> None:
        self._state, self._after, self._latency = packed_levels(state), packed_levels(after), latency
        self._alone = len(state) == 1
        super().__init__(
            {"level": In(len(state)), "level_z": In(1), "ready": In(1), "index": Out(1), "index_wide": Out(1)}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        here = Signal()  # in the state
        beyond = Signal()  # on its far side
        was_here = Signal()
        was_beyond = Signal()
        left_beyond = Signal()
        through = Signal()
        wide = Signal()
        m.d.comb += [
            here.eq(self.level == self._state),
            beyond.eq(0 if self._alone else self.level == self._after),
            self.index.eq(self.level_z & here),
            wide.eq(self.ready & self.index & ~was_here & through & (1 if self._alone else was_beyond ^ left_beyond)),
            self.index_wide.eq(*delay(m, wide, clocks=self._latency)),
        ]
        leaves = was_here & ~here
        m.d.sync += [
            was_here.eq(here),
            was_beyond.eq(beyond),
            through.eq(self.ready & self.level_z & (leaves | through)),  # Z since the state was left
            left_beyond.eq(Mux(leaves, beyond, left_beyond)),
        ]
        return m


def in_state(levels: Sequence[Signal], state: Levels) -> Signal:
    """Tell whether lines have these levels."""
    return Cat(*levels) == packed_levels(state)
