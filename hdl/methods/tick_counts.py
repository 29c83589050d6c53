"""The counts of a tick: how many, when, and where."""

from amaranth import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.formats.tracking import Tracking


class TickCounts(wiring.Component):
    """Adds up the times and the places of the counts of a tick; the outputs are new two clocks after `tick`.

    Parameters
    ----------
    form : Tracking
    max_ticks : int
        Longest silence in ticks.

    Members
    -------
    tick : In(1)
        The last clock of a tick.
    step : In(signed(2))
    tracks : In(1)
        There is a speed. Without, and if the tick before was empty, each count replaces those before it.
    number : Out
        Counts, at most `max_count`; with more, the last one alone.
    times : Out
        Sum of the clocks from each count to the end of the tick.
    places : Out(signed)
        Sum of their places relative to the end of the tick, in half counts.
    elapsed : Out
        Ticks since the last one with counts before this one, at most `max_ticks`.
    quiet : Out(1)
        These are as many.
    counted : Out(1)
        There were counts.
    length : Out
        Clocks of the tick.
    """

    def __init__(self, form: Tracking, max_ticks: int) -> None:
        self._form = form
        self._max_ticks = max_ticks
        super().__init__(
            {
                "tick": In(1),
                "step": In(signed(2)),
                "tracks": In(1),
                "number": Out(form.number_bits),
                "times": Out(form.times_bits),
                "places": Out(signed(form.places_bits)),
                "elapsed": Out(range(max_ticks + 1), init=max_ticks),
                "counted": Out(1),
                "quiet": Out(1),
                "length": Out(range(form.longest_tick + 1)),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        form = self._form
        number = Signal.like(self.number, name="open_number")
        times = Signal.like(self.times, name="open_times")
        places = Signal.like(self.places, name="open_places")
        alone = Signal(init=1)
        fresh = Signal()
        counts, backward = self.step.any(), self.step[-1]
        m.d.sync += fresh.eq(self.tick)
        # A count that replaces those before it, or the beginning of a tick.
        anew = Signal()
        m.d.comb += anew.eq(fresh | (counts & (alone | (number == form.max_count))))
        m.d.sync += [number.eq(number + counts), times.eq(times + number)]
        # A count moves the places of those before it away from the end, and its own edge is half a count off.
        twice = Cat(Const(1, 1), number, Const(0, 1))
        moved = Signal.like(places)
        minus = Signal()
        m.d.comb += [minus.eq(~backward), moved.eq((twice ^ minus.replicate(len(twice))).as_signed())]
        with m.If(counts):
            m.d.sync += places.eq((Cat(1, places).as_signed() + Cat(minus, moved).as_signed()) >> 1)
        with m.If(anew):
            m.d.sync += [number.eq(counts), times.eq(0), places.eq(Mux(counts, Mux(backward, 1, -1), 0))]
        with m.If(counts & (number == form.max_count)):
            m.d.sync += alone.eq(1)
        more = Signal.like(self.elapsed)
        quiet = Signal()
        m.d.comb += [quiet.eq(self.elapsed == self._max_ticks), more.eq(self.elapsed + ~quiet)]
        with m.If(self.counted):
            m.d.comb += more.eq(1)
        with m.If(fresh):
            m.d.sync += [
                self.number.eq(number),
                self.times.eq(times),
                self.places.eq(places),
                self.counted.eq(number.any()),
                self.elapsed.eq(more),
                alone.eq(~number.any() | ~self.tracks),
            ]
        m.d.comb += self.quiet.eq(quiet)
        if form.external:
            length = Signal.like(self.length, name="open_length", init=1)
            m.d.sync += length.eq(length + 1)
            with m.If(self.tick):
                m.d.sync += [self.length.eq(length), length.eq(1)]
        return m
