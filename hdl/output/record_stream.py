"""Records on AXI4-Stream."""

from collections.abc import Sequence

from amaranth import Cat, Module, Shape, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleCounter
from tachometry.spec.core.stream import OVERRUNS_WIDTH, Part


class RecordStream(wiring.Component):
    """Sends a record with each event; what comes while a record waits is dropped and counted.

    Latency: an event in clock c is in `m_axis_tvalid` in clock c + 1, if the record before is taken until clock c.

    Parameters
    ----------
    parts : sequence of Part
        What is in a record, `time` and `flags` first.
    flags : int
        Bits of `flags` beside the lowest: records were dropped since the one before.
    size : int
        Bytes of a record.
    packet : int
        Records from one `m_axis_tlast` to the next.

    Members
    -------
    event : In(1)
        There is a record, of the values in this clock.
    flags : In(flags)
    position, velocity … : In
        Values of the other parts.
    clear : In(1)
        `overruns` is 0 in the next clock.
    m_axis_tdata, m_axis_tvalid, m_axis_tlast, m_axis_tready
        Its name in AXI4-Stream.
    overruns : Out(OVERRUNS_WIDTH)
        Number of dropped records, which stays at its end.
    """

    def __init__(self, parts: Sequence[Part], flags: int, size: int, packet: int) -> None:
        self._parts, self._packet = parts, packet
        super().__init__(
            {
                "event": In(1),
                "flags": In(flags),
                **{part.name: In(Shape(part.width, part.signed)) for part in parts[2:]},
                "clear": In(1),
                "m_axis_tdata": Out(8 * size),
                "m_axis_tvalid": Out(1),
                "m_axis_tlast": Out(1),
                "m_axis_tready": In(1),
                "overruns": Out(OVERRUNS_WIDTH),
            }
        )

    @property
    def idle(self) -> tuple[Idle, ...]:
        """The time, which a simulation may move on."""
        return (IdleCounter("clocks", 1),)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        clocks = Signal(32)
        lost = Signal()
        free = Signal()
        left = Signal(range(max(self._packet, 2)), init=self._packet - 1)  # of the packet, behind the next record
        now = {"time": clocks, "flags": Cat(lost, self.flags)}
        m.d.comb += free.eq(~self.m_axis_tvalid | self.m_axis_tready)
        m.d.sync += [clocks.eq(clocks + 1), self.m_axis_tvalid.eq(self.event | ~free)]
        with m.If(self.event):
            m.d.sync += lost.eq(~free)
        with m.If(self.event & free):
            m.d.sync += [self.m_axis_tlast.eq(left == 0), left.eq(left - 1)]
            with m.If(left == 0):
                m.d.sync += left.eq(self._packet - 1)
        for part in self._parts:
            value = now.get(part.name, getattr(self, part.name, None))
            held = Signal.like(value, name=f"held_{part.name}")
            with m.If(self.event & free):
                m.d.sync += held.eq(value)
            m.d.comb += self.m_axis_tdata[8 * part.offset : 8 * (part.offset + part.size)].eq(held)
        with m.If(self.event & ~free & ~self.overruns.all()):
            m.d.sync += self.overruns.eq(self.overruns + 1)
        with m.If(self.clear):
            m.d.sync += self.overruns.eq(0)
        return m
