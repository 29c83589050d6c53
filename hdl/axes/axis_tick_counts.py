"""The counts of a tick of every axis, for the tracking method."""

from collections.abc import Mapping
from typing import Any

from amaranth import C, Module, Mux, Signal, signed
from amaranth.lib import data

from tachometry.hdl.axes.axis_counters import AxisCounters
from tachometry.hdl.methods.tick_counts import TickCounts, sums
from tachometry.hdl.wires.delay import delay
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
        earlier_first, earlier_ready = delay(m, self.first, self.ready)
        # As a reset of registers, which takes no cells.
        with m.If(earlier_first):
            m.d.sync += [before[name].eq(0) for name in ("number", "places", "moved", "times")]
        with m.If(~earlier_ready):  # a reset does not clear the memory
            m.d.sync += before.end.eq(0)
        number, moved = before.number, before.moved
        takes = Signal()
        m.d.comb += takes.eq(counts & (number != self._form.most_number))
        place = TickCounts.place(moved[: self._form.number_bits + 1], backward, takes)
        last, times, next_moved, places = sums(
            (before.last, C(0, 1), C(1, 1)),
            (before.times, number & ~1, number[0]),
            (moved, backward.replicate(len(moved)), counts & ~backward),
            (before.places, place, takes),
        )
        m.d.sync += [
            new.end.eq(before.end + step),
            new.last.eq(Mux(counts | ~number.any(), 0, last)),  # an axis that stands changes nothing
            new.moved.eq(next_moved),
            new.times.eq(times),
            new.number.eq(number + takes),
            new.places.eq(places),
            new.kind.eq(Mux(takes, before.end - backward, before.kind)),
            new.down.eq(Mux(takes, backward, before.down)),
        ]
