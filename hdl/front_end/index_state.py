"""The index in one state of the lines."""

from collections.abc import Sequence

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.spec.core.sensors import Levels, packed_levels


class IndexState(Box):
    """Lets the index Z through in one state of the lines alone, which is one place of a period in both directions.

    An index that is wider than a period meets the state twice. So Z that stays high while the lines leave the state on
    one side, and come back to it from the other, is reported; of a single line, that they come back at all.

    An index beside the state never meets it. So Z that comes and goes without it is reported, if the steps before it
    has come, before it has gone, and after that have one direction: a shaft that turns back has not passed it.

    Latency: none of `index`; `index_wide` is high `latency` clocks after the state has come back, `index_missed` as
    many after the first step with Z low, in this clock and the one before.

    - `state`, `after`: The levels of the lines, and those that follow them forward.
    """

    def __init__(self, state: Levels, after: Levels, latency: int) -> None:
        self._state, self._after, self._latency = packed_levels(state), packed_levels(after), latency
        self._alone = len(state) == 1
        super().__init__(
            level=In(len(state)),  # levels of the lines, the first lowest
            step=In(signed(2)),
            level_z=In(1),
            ready=In(1),  # all levels, and those of the clock before, are real
            **dict.fromkeys(("index", "index_wide", "index_missed"), Out(1)),
        )

    def build(self, m: Module) -> None:
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
        self._pass(m)
        leaves = was_here & ~here
        m.d.sync += [
            was_here.eq(here),
            was_beyond.eq(beyond),
            through.eq(self.ready & self.level_z & (leaves | through)),  # Z since the state was left
            left_beyond.eq(Mux(leaves, beyond, left_beyond)),
        ]

    def _pass(self, m: Module) -> None:
        """Detect that Z has come and gone without the state."""
        was_z = Signal()
        passing = Signal()  # Z has come, and no step with Z low since it went
        met = Signal()
        entered = Signal()  # directions, high is backward: of the step before Z came
        last = Signal()  # of the latest step before this clock
        latest = Signal()
        ends = passing & self.step[0] & ~self.level_z & ~was_z
        missed = ends & ~met & (entered == last) & (last == self.step[1])
        m.d.comb += [
            latest.eq(Mux(self.step[0], self.step[1], last)),
            self.index_missed.eq(*delay(m, missed, clocks=self._latency)),
        ]
        m.d.sync += [
            was_z.eq(self.level_z),
            last.eq(latest),
            passing.eq((self.ready & self.level_z & ~was_z) | (passing & ~ends)),
            met.eq(self.index | (met & passing)),
            entered.eq(Mux(passing, entered, latest)),
        ]


def in_state(levels: Sequence[Signal], state: Levels) -> Signal:
    """Return whether lines have these levels."""
    return Cat(*levels) == packed_levels(state)
