"""The counts of a tick of every axis, for the tracking method."""

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data, wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.decoder import transition
from tachometry.hdl.wires.delay import delay
from tachometry.spec.formats.tracking import Tracking


def counts_layout(form: Tracking) -> data.StructLayout:
    """Return what is added up in a tick, as `TickCounts` says; `end` is the position modulo 4."""
    return data.StructLayout(
        {
            "number": form.number_bits,
            "times": form.times_bits,
            "places": signed(form.places_bits),
            "kind": 2,
            "down": 1,
            "last": range(form.longest_tick),
            "moved": signed(form.moved_bits),
            "end": 2,
        }
    )


class AxisTickCounts(wiring.Component):
    """Decodes the lines of an axis in its slot, and adds up times and places of its counts, in rounds.

    It does what `AxisCounters` and `TickCounts` do. Latency: that of `AxisCounters`.

    Parameters
    ----------
    slots : int
    form : Tracking
        That of an axis.
    decoding : int
        Counts per period: 1, 2 or 4.

    Members
    -------
    slot, first, last, ready, level_a, level_b : In
        As of `AxisCounters`.
    axis, step, decode_error, complete : Out
        As of `AxisCounters`.
    count : Out(counts_layout(form))
        Of this tick so far.
    """

    def __init__(self, *, slots: int, form: Tracking, decoding: int) -> None:
        self._slots = slots
        self._form = form
        self._decoding = decoding
        super().__init__(
            {
                "slot": In(range(slots)),
                **dict.fromkeys(("first", "last", "ready", "level_a", "level_b"), In(1)),
                "axis": Out(range(slots)),
                "step": Out(signed(2)),
                "decode_error": Out(1),
                "complete": Out(1),
                "count": Out(counts_layout(form)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        kept = data.StructLayout({"a": 1, "b": 1, "count": counts_layout(self._form)})
        m.submodules.memory = memory = Memory(shape=kept, depth=self._slots, init=[])
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
        m.d.comb += [read.addr.eq(self.slot), counts.eq(ready & counted), step.eq(Cat(counts, counts & backward))]
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
        return m

    def _add(self, m: Module, before: data.View, first: Signal, ready: Signal, step: Signal) -> None:
        counts, backward, new = step.any(), step[-1], self.count
        number, places, way, times = (Mux(first, 0, before[name]) for name in ("number", "places", "moved", "times"))
        place = Signal(2)
        m.d.comb += place.eq(Mux(ready, before.end, 0))  # the memory is not that of a reset
        m.d.sync += [
            new.end.eq(place + step),
            new.last.eq(Mux(counts | ~number.any(), 0, before.last + 1)),  # an axis that stands changes nothing
            new.moved.eq(way + step),
            new.times.eq(times + number),
            new.number.eq(number),
            new.places.eq(places),
            new.kind.eq(before.kind),
            new.down.eq(before.down),
        ]
        with m.If(counts & (number != self._form.most_number)):
            m.d.sync += [
                new.number.eq(number + 1),
                new.places.eq(places + (Cat(Const(0, 1), way).as_signed() + step)),
                new.kind.eq((place - backward)[:2]),
                new.down.eq(backward),
            ]
