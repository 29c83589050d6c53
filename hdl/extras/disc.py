"""Gates of `spec.core.extras.disc`."""

from collections.abc import Sequence
from typing import Self

from amaranth import Module, Mux, Signal, Value, signed
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.extras.sectors import SectorTable
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, drive, only_if
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.disc import SLIPS_BITS, DiscMap
from tachometry.spec.formats.displacement import DISPLACED, ENTRY_BITS, MAPPED, Displacement
from tachometry.spec.formats.sectors import SLOPE_BITS, Sectors


class Gates(Box):
    """A table of the edges, the place in the turn that says which edge a step passes, and trust in that place.

    Latency: `displaced` is valid 2 clocks after its `step`, and 0 in clocks without one; `displaced_before` is
    that of the step before, a clock earlier. An index or a turn moves the place in a clock without a step; an index
    that comes with a step is left out.

    - `table`: The table after configuration: of the edges, or of sectors.
    - `looks`: Without a step, `displaced` is that of the next edge in the direction of the last step.
    - `place`: Where the index comes; None: there is none, and turns move the place.
    """

    def __init__(
        self, table: Sequence[int] | Sectors, place: int | None, form: Displacement, *, writable: bool, looks: bool
    ) -> None:
        edges, bits = (table.edges, SLOPE_BITS) if isinstance(table, Sectors) else (len(table), ENTRY_BITS)
        self._edges, self._table, self._place, self._form = edges, table, place, form
        self._writable, self._looks, indexed, entry = writable, looks, place is not None, signed(bits)
        super().__init__(
            step=In(signed(2)),
            **dict.fromkeys(("disc_bypass", "disc_forget"), In(1)),
            **only_if(indexed, index_seen=In(1), clear=In(1), disc_slip=Out(1), disc_slips=Out(SLIPS_BITS)),
            **only_if(not indexed, disc_turn=In(1), disc_turn_by=In(range(edges))),
            **only_if(writable, disc_write=In(1), disc_address=In(range(len(table))), disc_data=In(entry)),
            **only_if(writable, disc_entry=Out(entry)),
            **dict.fromkeys(("disc_used", "disc_sure", MAPPED), Out(1)),
            **dict.fromkeys(DISPLACED, Out(signed(form.width))),
        )

    @classmethod
    def of(cls, extra: DiscMap, spec: TachometerSpec) -> Self:
        table = extra.sectors(spec) or extra.entries(spec)
        place, form = extra.index_place(spec), extra.displacement(spec)
        return cls(table, place, form, writable=extra.writable, looks=spec.facts.update_by != "count")

    def build(self, m: Module) -> None:
        step = self.step
        writes = Signal()
        if self._writable:
            m.d.sync += writes.eq(self.disc_write)
        entry = self._follow(m, step, self.disc_forget | writes, writes)
        (counted,) = delay(m, step[0])
        (shows,) = delay(m, counted)
        latest = Signal.like(self.displaced)
        m.d.sync += [self.displaced.eq(entry << self._form.shift), latest.eq(self.displaced_before)]
        with m.If(~(self.disc_used & (counted | self._looks))):  # the reset of a flip-flop is free
            m.d.sync += self.displaced.eq(0)
        m.d.comb += [self.displaced_before.eq(Mux(shows, self.displaced, latest)), self.mapped.eq(self.disc_used)]

    def _read(self, m: Module, edge: Value, writes: Value, entries: Sequence[int]) -> Value:
        """Return the entry of the edge of the clock before; what is read while it is written is not used."""
        shape, depth = signed(ENTRY_BITS), 1 << (self._edges - 1).bit_length()
        memory = Memory(shape=shape, depth=depth, init=entries, attrs={"no_rw_check": 1})
        m.submodules.table = memory
        read = memory.read_port()
        m.d.comb += read.addr.eq(edge)
        if self._writable:
            write = memory.write_port()
            shows = memory.read_port()
            m.d.comb += [
                *(port.addr.eq(self.disc_address) for port in (write, shows)),
                write.data.eq(self.disc_data),
                write.en.eq(writes),
                self.disc_entry.eq(shows.data),
            ]
        return read.data

    def _follow(self, m: Module, step: Signal, forgets: Value, writes: Value) -> Value:
        """Follow the place and the trust in it; return the entry of the edge that a step has passed a clock before."""
        edges = self._edges
        place = Signal(range(edges))
        trust = Signal(2)
        moved = Signal.like(place)  # by the step of this clock
        back = Signal()
        was = Signal()
        seen = Signal()  # an index
        m.d.comb += back.eq(Mux(step[0], step[1], was))
        m.d.sync += was.eq(back)
        ends = place == Mux(back, 0, edges - 1)
        m.d.comb += moved.eq(Mux(ends, Mux(back, edges - 1, 0), place + Mux(back, -1, 1)))
        with m.If(step[0]):
            m.d.sync += place.eq(moved)
        used, unsure = trust[0], trust[0] ^ trust[1]
        m.d.comb += [self.disc_used.eq(used & ~self.disc_bypass), self.disc_sure.eq(trust.all())]
        if self._place is None:
            self._turn(m, step, place, trust)
        else:
            known, agrees = trust.any(), place == self._place
            m.d.comb += seen.eq(self.index_seen & ~step[0])
            m.d.sync += self.disc_slip.eq(seen & known & ~agrees)
            m.d.sync += self.disc_slips.eq(self.disc_slips + (self.disc_slip & ~self.disc_slips.all()))
            with m.If(self.clear):
                m.d.sync += self.disc_slips.eq(0)
            with m.If(seen):
                m.d.sync += [place.eq(self._place), trust[0].eq(agrees | ~unsure)]
                m.d.sync += trust[1].eq(known & (agrees | unsure))
        with m.If(forgets):
            m.d.sync += trust.eq(0)
        if not isinstance(self._table, Sectors):
            return self._read(m, Mux(back, place, moved), writes, self._table)
        assert self._place is not None
        m.submodules.table = table = SectorTable(self._table, self._place, self._form.entry_bits, self._writable)
        drive(m, table, {"place": place, "back": back, "ends": ends, "counted": step[0], "seen": seen})
        if self._writable:
            drive(m, table, {"write": writes, "address": self.disc_address, "data": self.disc_data})
            m.d.comb += self.disc_entry.eq(table.shown)
        return table.entry

    def _turn(self, m: Module, step: Signal, place: Signal, trust: Signal) -> None:
        """Move the place by `disc_turn_by`, in the first clock without a step."""
        edges = self._edges
        waits = Signal()
        asked = Signal()
        by = Signal.like(place)
        total = Signal(range(2 * edges))
        rest = Signal(signed(len(total) + 1))
        m.d.comb += [total.eq(place + by), rest.eq(total - edges)]
        m.d.sync += asked.eq(self.disc_turn)
        with m.If(waits & ~step[0]):
            m.d.sync += [place.eq(Mux(rest < 0, total, rest)), trust.eq(1), waits.eq(0)]
        with m.If(asked & (self.disc_turn_by < edges)):
            m.d.sync += [by.eq(self.disc_turn_by), waits.eq(1)]
