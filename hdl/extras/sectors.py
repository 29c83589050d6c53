"""A table of sectors: displacements of edges from the slopes of a line."""

from amaranth import Array, Module, Mux, Signal, signed
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.sectors import SLOPE_BITS, Sectors


class SectorTable(Box):
    """Follows the value of the edge below the place, see `Sectors`, by an addition for each step.

    Latency: `entry` is that of the edge that a step passes, or would pass, a clock later.

    - `index`: The place of the index.
    """

    def __init__(self, table: Sectors, index: int) -> None:
        self._table, self._index = table, index
        super().__init__(
            {
                "place": In(range(table.edges)),
                "back": In(1),  # the direction of the latest step
                "ends": In(1),  # that step crosses edge 0
                "counted": In(1),
                "seen": In(1),  # an index sets the place
                "entry": Out(signed(table.width)),
            }
        )

    def build(self, m: Module) -> None:
        table = self._table
        values, half = table.values, 1 << table.fine - 1
        depth = 1 << (len(table.slopes) - 1).bit_length()
        slopes = [*table.slopes, *table.slopes[-1:] * (depth - len(table.slopes))]
        value = Signal(signed((max(map(abs, values)) + half).bit_length() + 1), init=half)
        slope = Signal(signed(SLOPE_BITS))
        sector = Signal(range(depth))
        begins = self.back & ~self.place[: table.bits].any()  # backward from the first edge of a sector
        m.d.comb += sector.eq((self.place >> table.bits) - begins)  # below the first one is the last one
        m.d.sync += slope.eq(Array(slopes)[sector])
        back, ends, counted, seen = (delay(m, one)[0] for one in (self.back, self.ends, self.counted, self.seen))
        moved = Signal.like(value)
        begin = Mux(ends & back, half + values[-1], value)
        m.d.comb += moved.eq(Mux(ends & ~back, half, begin + (slope ^ back.replicate(SLOPE_BITS).as_signed()) + back))
        with m.If(counted):
            m.d.sync += value.eq(moved)
        with m.If(seen):
            m.d.sync += value.eq(half + values[self._index])
        shown = Mux(back, value, moved) >> table.fine
        if table.quarters:
            quarter = Signal(signed(max(map(abs, table.quarters)).bit_length() + 1))
            m.d.sync += quarter.eq(Array(table.quarters)[(self.place + ~self.back)[:2]])
            shown += quarter
        m.d.comb += self.entry.eq(shown)
