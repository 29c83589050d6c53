"""A register keeps the position at the index."""

from amaranth import Module, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if


class IndexCapture(Box):
    """Captures the position when the index line Z rises.

    Latency: if `level_z` rises in clock c, `index_valid` is high in clock c + `latency`, and `index_position` is the
    sum of all steps through clock c. `position` has this value in that clock, unless the index sets it to 0.

    - `once`: An index is taken only if `arm` was high since the one before.
    - `early`: `first` is high in clock c + 1; else a clock before `index_valid`.
    """

    def __init__(self, width: int, latency: int = 2, *, once: bool = False, early: bool = False) -> None:
        self._late, self._early = latency - 2, early
        self._once = once
        super().__init__(
            level_z=In(1),
            ready=In(1),  # the level before the present one is real
            position=In(signed(width)),  # the position of the next clock
            **only_if(once, arm=In(1)),  # the next index is taken; as late as a rise
            **only_if(once, homed=Out(1)),  # the index was taken, since `arm`
            rises=Out(1),  # high a clock before `index_valid`
            index_position=Out(signed(width)),  # held until the next index
            index_valid=Out(1),  # one clock per index
        )
        self.seen = Signal(name="seen") if once else self.rises
        self.first = Signal(name="first") if early and latency > 2 else self.seen

    def build(self, m: Module) -> None:
        level, ready = delay(m, self.level_z, self.ready, clocks=0 if self._early else self._late)
        past_z = Signal()
        m.d.sync += [past_z.eq(level), self.first.eq(level & ~past_z & ready), self.index_valid.eq(self.rises)]
        if self.first is not self.seen:
            m.d.comb += self.seen.eq(*delay(m, self.first, clocks=self._late))
        if self._once:
            armed = Signal()
            m.d.comb += self.rises.eq(self.seen & armed)
            with m.If(self.arm):
                m.d.sync += [armed.eq(1), self.homed.eq(0)]
            with m.Elif(self.rises):
                m.d.sync += [armed.eq(0), self.homed.eq(1)]
        with m.If(self.rises):
            m.d.sync += self.index_position.eq(self.position)
