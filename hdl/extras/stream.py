"""Gates of `spec.core.extras.stream`."""

from collections.abc import Sequence
from typing import Self

from amaranth import Cat, Module, Shape, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, by_name
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.stream import OVERRUNS_WIDTH, Part, Stream, size_of
from tachometry.spec.language.port import TICK, UPDATE

_EVENTS = {"tick": TICK, "update": UPDATE, "edge": "step"}


class Gates(Box):
    """An event in clock c is in `m_axis_tvalid` in clock c + 1, if the record before is taken until clock c.

    An event while a record waits is dropped and counted. A value is that of its port in the clock of the event.

    - `parts`: Parts of a record, `time` and `flags` first.
    - `flags`: Ports that are the bits of `flags` behind the lowest, which says that records were dropped before.
    - `packet`: Records from one `m_axis_tlast` to the next.
    - `event`: The strobe with which a record comes, or `step`, which is `latency` clocks ahead of the values.
    """

    def __init__(self, parts: Sequence[Part], flags: Sequence[str], packet: int, event: str, latency: int = 0) -> None:
        self._parts, self._flags, self._packet, self._event, self._latency = parts, flags, packet, event, latency
        super().__init__(
            {
                event: In(signed(2) if event == "step" else 1),
                **dict.fromkeys((*flags, "clear", "m_axis_tready"), In(1)),
                **{part.name: In(Shape(part.width, part.signed)) for part in parts[2:]},
                "m_axis_tdata": Out(8 * size_of(parts)),
                **dict.fromkeys(("m_axis_tvalid", "m_axis_tlast"), Out(1)),
                "overruns": Out(OVERRUNS_WIDTH),
            }
        )

    @classmethod
    def of(cls, extra: Stream, spec: TachometerSpec) -> Self:
        event, flags = _EVENTS[extra.records.when], extra.flags(spec)[1:]
        return cls(extra.parts(spec), flags, extra.records.packet, event, spec.latency.tick)

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time, which a simulation may move on."""
        return (IdleCounter("clocks", 1),)

    def build(self, m: Module) -> None:
        clocks = Signal(32)
        lost = Signal()
        free = Signal()
        left = Signal(range(max(self._packet, 2)), init=self._packet - 1)  # of the packet, behind the next record
        now = {"time": clocks, "flags": Cat(lost, *by_name(self, self._flags).values())}
        now |= by_name(self, (part.name for part in self._parts[2:]))
        (event,) = by_name(self, [self._event]).values()
        if self._event == "step":
            (event,) = delay(m, self.step[0], clocks=self._latency)
        m.d.comb += free.eq(~self.m_axis_tvalid | self.m_axis_tready)
        m.d.sync += [clocks.eq(clocks + 1), self.m_axis_tvalid.eq(event | ~free)]
        with m.If(event):
            m.d.sync += lost.eq(~free)
        with m.If(event & free):
            m.d.sync += [self.m_axis_tlast.eq(left == 0), left.eq(left - 1)]
            with m.If(left == 0):
                m.d.sync += left.eq(self._packet - 1)
        for part in self._parts:
            held = Signal.like(now[part.name], name=f"held_{part.name}")
            with m.If(event & free):
                m.d.sync += held.eq(now[part.name])
            m.d.comb += self.m_axis_tdata[8 * part.offset : 8 * (part.offset + part.size)].eq(held)
        with m.If(event & ~free & ~self.overruns.all()):
            m.d.sync += self.overruns.eq(self.overruns + 1)
        with m.If(self.clear):
            m.d.sync += self.overruns.eq(0)
