"""The counts of a tick of every axis, for the tracking method."""

from collections.abc import Mapping
from typing import Any

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import data

from tachometry.hdl.axes.axis_counters import AxisCounters
from tachometry.spec.formats.tracking import Tracking

# Of a memory of wide words, none of which is read in the clock in which it is written.
BLOCK: Mapping[str, str | int] = {"ram_style": "block", "no_rw_check": 1}


def counts_layout(form: Tracking) -> data.StructLayout:
    """Return the sums of a tick, see `TickCounts`; `end` is the position modulo 4."""
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


class AxisTickCounts(AxisCounters):
    """Decodes the lines of an axis in its slot, and adds up times and places of its counts, in rounds.

    It does what `TickCounts` does for one axis. Members and latency are those of `AxisCounters`, but `count`:
    Out(counts_layout(form)), of this tick so far.
    """

    def __init__(self, *, slots: int, form: Tracking, decoding: int, reverse: bool = False) -> None:
        self._reverse, self._form = reverse, form
        self._take(slots, decoding, counts_layout(form), BLOCK)

    def _add(self, m: Module, before: Any, first: Signal, ready: Signal, step: Signal) -> None:
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
