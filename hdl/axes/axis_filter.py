"""The glitch filter of every axis."""

from collections.abc import Sequence

from amaranth import Module, Mux, Signal
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name


class AxisFilter(Box):
    """Passes a level of an axis when it was the same at `looks` looks that follow each other; see `GlitchFilter`.

    Latency: what is seen in a slot is at the outputs three clocks later, and so are the other inputs.
    """

    def __init__(self, *, slots: int, looks: int, lines: Sequence[str]) -> None:
        self._slots, self._looks = slots, looks
        self._lines = tuple(lines)
        super().__init__(
            slot=In(range(slots)),
            **dict.fromkeys(("first", "last", "ready", "real"), In(1)),  # of this round, see `Rounds`
            **{f"level_{name}": In(1) for name in lines},  # of the axis whose slot it is
            seen_slot=Out(range(slots)),  # of the axis that the other outputs belong to
            **dict.fromkeys(("seen_first", "seen_last", "seen_ready"), Out(1)),
            # `known`: the level before the present one is one of the line as well.
            **{f"{what}_{name}": Out(1) for name in lines for what in ("filtered", "known")},
        )

    def build(self, m: Module) -> None:
        of_line = data.StructLayout({"filtered": 1, "known": 1, "before": 1, "held": range(max(self._looks, 2))})
        kept = data.StructLayout(dict.fromkeys(self._lines, of_line))
        m.submodules.memory = memory = Memory(shape=kept, depth=self._slots, init=[])
        read = memory.read_port()
        write = memory.write_port()
        lines = by_name(self, self._lines, "level_{}").values()
        round_ = self.slot, self.first, self.last, self.ready, self.real
        slot, first, last, ready, real, *levels = delay(m, *round_, *lines, clocks=2)
        # Block RAM is slow.
        before = Signal(kept)
        after = Signal(kept)
        m.d.sync += before.eq(read.data)
        filtered, known = by_name(self, self._lines, "filtered_{}"), by_name(self, self._lines, "known_{}")
        for name, level in zip(self._lines, levels, strict=True):
            new = self._next(m, before[name], level, name)
            m.d.sync += [
                filtered[name].eq(before[name].filtered),
                known[name].eq(before[name].before & real),
                after[name].eq(Mux(real, new.as_value(), 0)),
            ]
        m.d.sync += [
            self.seen_slot.eq(slot),
            self.seen_first.eq(first),
            self.seen_last.eq(last),
            self.seen_ready.eq(ready),
        ]
        m.d.comb += [read.addr.eq(self.slot), write.addr.eq(self.seen_slot), write.data.eq(after), write.en.eq(1)]

    def _next(self, m: Module, state: data.View, level: Signal, name: str) -> data.View:
        """Return the state of a line after a look at it."""
        new = Signal(state.shape(), name=f"next_{name}")
        differs = level ^ state.filtered
        first = int(self._looks > 1)  # looks that a first level has held with its first, if these are not enough
        m.d.comb += [new.eq(state), new.before.eq(state.known)]
        with m.If(differs != state.known):
            m.d.comb += new.held.eq(Mux(state.known, 0, first))
            with m.If(~state.known):
                m.d.comb += [new.filtered.eq(level), new.known.eq(not first)]
        with m.Elif(state.held == self._looks - 1):
            m.d.comb += [new.filtered.eq(level), new.known.eq(1), new.held.eq(0)]
        with m.Else():
            m.d.comb += new.held.eq(state.held + 1)
        return new
