"""m_e of every axis."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from amaranth import Cat, Const, Module, Mux, ShapeLike, Signal, Value, signed
from amaranth.lib import data
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.decoder import transition
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box


class AxisCounters(Box):
    """Decodes the lines of an axis in its slot, and adds up the steps of its tick; levels and sums are in a memory.

    Latency: what is seen in a slot is at the outputs three clocks later. It is back in the memory a clock after that,
    when the axis has its next slot at the earliest: a round has four at least.

    - `rounds`: Rounds of a tick: most steps of an axis in it.
    """

    def __init__(self, *, slots: int, rounds: int, decoding: int, reverse: bool = False) -> None:
        self._reverse = reverse
        self._take(slots, decoding, signed(rounds.bit_length() + 1))

    def _take(
        self, slots: int, decoding: int, count: ShapeLike, memory: Mapping[str, str | int] = MappingProxyType({})
    ) -> None:
        """Have the ports of a core that adds up this, in a memory with these attributes."""
        self._memory = memory
        self._slots = slots
        self._decoding = decoding
        super().__init__(
            slot=In(range(slots)),
            **dict.fromkeys(("first", "last"), In(1)),  # of this round, see `Rounds`
            ready=In(1),  # the levels of this round and of the one before are those of the lines
            **dict.fromkeys(("level_a", "level_b"), In(1)),  # of the axis whose slot it is
            axis=Out(range(slots)),  # that the other outputs belong to
            step=Out(signed(2)),
            decode_error=Out(1),  # both lines changed
            complete=Out(1),  # the tick of this axis is over
            count=Out(count),  # sum of its steps in this tick
        )

    def build(self, m: Module) -> None:
        kept = data.StructLayout({"a": 1, "b": 1, "count": self.count.shape()})
        m.submodules.memory = memory = Memory(shape=kept, depth=self._slots, init=[], attrs=self._memory)
        read = memory.read_port()
        write = memory.write_port()
        seen = self.level_a, self.level_b, self.slot, self.first, self.last, self.ready
        a, b, slot, first, last, ready = delay(m, *seen, clocks=2)
        # Block RAM is slow.
        before = Signal(kept)
        m.d.sync += before.eq(read.data)
        counted, backward, illegal = transition(self._decoding, a, b, before.a, before.b)
        counts = Signal()
        step = Signal.like(self.step)
        m.d.comb += [
            read.addr.eq(self.slot),
            counts.eq(ready & counted),
            step.eq(Cat(counts, counts & (~backward if self._reverse else backward))),
        ]
        self._add(m, before.count, first, ready, step)
        new_a, new_b = delay(m, a, b)
        m.d.sync += [
            self.axis.eq(slot),
            self.step.eq(step),
            self.decode_error.eq(ready & illegal),
            self.complete.eq(last),
        ]
        m.d.comb += [
            write.addr.eq(self.axis),
            write.data.a.eq(new_a),
            write.data.b.eq(new_b),
            write.data.count.eq(self.count),
            write.en.eq(1),
        ]

    def _add(self, m: Module, before: Any, first: Signal, ready: Signal, step: Signal) -> None:
        """Add a step to what was added up in the rounds before."""
        m.d.sync += self.count.eq(Mux(first, 0, before) + step)


def of_slot(lines: Signal, slot: Signal) -> Value:
    """Return the line of the axis whose slot it is; those of nobody stay low."""
    return Cat(lines, Const(0, 1 << len(slot))).bit_select(slot, 1)
