"""A table of sectors: displacements of edges from the slopes of a line."""

from collections.abc import Sequence

from amaranth import Array, Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, only_if
from tachometry.spec.formats.sectors import SLOPE_BITS, Sectors


class SectorTable(Box):
    """Follows the value of the edge below the place, see `Sectors`, by an addition for each step.

    Latency: `entry` is that of the edge that a step passes, or would pass, a clock later; `shown` is what the table has
    at `address` a clock later.

    - `index`: The place of the index, below 4.
    - `width`: Bits of an entry, signed; values that do not fit wrap.
    """

    def __init__(self, table: Sectors, index: int, width: int, writable: bool) -> None:
        self._table, self._index, self._width, self._writable = table, index, width, writable
        super().__init__(
            place=In(range(table.edges)),
            back=In(1),  # the direction of the latest step
            ends=In(1),  # that step crosses edge 0
            counted=In(1),
            seen=In(1),  # an index sets the place
            entry=Out(signed(width)),
            **only_if(writable, write=In(1), address=In(range(len(table))), data=In(signed(SLOPE_BITS))),
            **only_if(writable, shown=Out(signed(SLOPE_BITS))),
        )

    def build(self, m: Module) -> None:
        table, back = self._table, self.back
        value = Signal(signed(self._width + table.fine), init=(half := 1 << table.fine - 1))
        at_index = Signal.like(value, init=self._index * table.slopes[0])
        sector = Signal(range(table.depth))
        begins = back & ~self.place[: table.bits].any()  # backward from the first edge of a sector
        m.d.comb += sector.eq(Mux(self.ends, len(table.slopes) - 1, (self.place >> table.bits) - begins))
        writes = (self.write, self.address < table.depth) if self._writable else (Value.cast(0),) * 2
        slope, slopes = self._read(m, "slopes", table.entries[: table.depth], sector, writes[0] & writes[1])
        was, counted, seen = (delay(m, one)[0] for one in (back, self.counted, self.seen))
        moved = Signal.like(value)
        m.d.comb += moved.eq(value + (slope ^ was.replicate(SLOPE_BITS).as_signed()) + was)
        with m.If(counted):
            m.d.sync += value.eq(moved)
        with m.If(seen):
            m.d.sync += value.eq(half + at_index)
        entry = Mux(was, value, moved) >> table.fine
        if table.quarters:
            passed = (self.place + ~back)[:2]
            quarter, quarters = self._read(m, "quarters", table.quarters, passed, writes[0] & ~writes[1])
            entry += quarter
            slopes = Mux(delay(m, writes[1])[0], slopes, quarters)
        m.d.comb += self.entry.eq(entry)
        if self._writable:
            m.d.comb += self.shown.eq(slopes)
            with m.If(self.write & (self.address == 0)):
                m.d.sync += at_index.eq(self.data * self._index)

    def _read(self, m: Module, name: str, entries: Sequence[int], address: Value, write: Value) -> tuple[Value, Value]:
        """Return the entry at an address a clock before, and the one that a program asks for."""
        if not self._writable:
            entry = Signal(signed(max(map(abs, entries)).bit_length() + 1))
            m.d.sync += entry.eq(Array(entries)[address])
            return entry, entry
        memory = Memory(shape=signed(SLOPE_BITS), depth=len(entries), init=entries, attrs={"no_rw_check": 1})
        m.submodules[name] = memory
        read = memory.read_port()
        shows = memory.read_port()
        port = memory.write_port()
        m.d.comb += [read.addr.eq(address), shows.addr.eq(self.address), port.addr.eq(self.address)]
        m.d.comb += [port.data.eq(self.data), port.en.eq(write)]
        return read.data, shows.data
