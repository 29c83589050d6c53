"""A wheel with missing teeth."""

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec.core.tooth_wheel import ToothWheel


class GapFiller(wiring.Component):
    """Puts teeth where a wheel has none, and finds its gap, see `ToothWheel`.

    Latency: none. What it finds of a tooth is in the clock of the tooth. A tooth that is put in is as many clocks after
    the one before as the latest two teeth before the gap were apart.
    """

    def __init__(self, wheel: ToothWheel) -> None:
        self._wheel = wheel
        super().__init__(
            {
                "tooth": In(1),  # high in the clock of a tooth, never in two clocks in a row
                "filled": Out(1),  # high in the clock of a tooth, there or not
                "index": Out(1),  # this tooth is the first one after a gap
                "error": Out(1),  # this tooth is in the gap
                "synced": Out(1),  # the gap is known, from the clock after the first index on
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        wheel = self._wheel
        since = Signal(wheel.width, init=wheel.longest)  # clocks from the latest tooth on, at their end before any
        period = Signal.like(since, init=0)
        left = Signal(wheel.width)  # to the end of a half period
        halves = Signal(range(wheel.most_halves + 1))
        known = Signal()  # the period is of two teeth in a row
        place = Signal(range(wheel.teeth))  # teeth to come until the gap
        long = Signal()
        here = Signal()
        ends = Signal()
        found = Signal()
        latest = Signal.like(period)
        m.d.comb += [
            long.eq(since == wheel.longest),
            here.eq(self.synced & (place == 0)),
            ends.eq(left == 1),
            found.eq(known & ~long & (halves != wheel.most_halves)),
            self.index.eq(self.tooth & (halves >= wheel.fewest_halves) & Mux(self.synced, here, found)),
            self.error.eq(self.tooth & here & (halves < wheel.fewest_halves)),
            self.filled.eq(self.tooth | (here & ends & halves[0] & (halves < 2 * wheel.missing))),
            latest.eq(Mux(self.tooth & ~self.index & ~long, since, period)),
        ]
        m.d.sync += [
            period.eq(latest),
            left.eq(left - 1),
            since.eq(Mux(self.tooth, 1, since + ~long)),
            self.synced.eq(self.index | (self.synced & ~self.error)),
        ]
        with m.If(self.tooth):
            m.d.sync += [left.eq(latest >> 1), halves.eq(0), place.eq(Mux(self.index, wheel.teeth - 1, place - 1))]
            with m.If(~self.index):
                m.d.sync += known.eq(~long)
        with m.Elif(ends):
            m.d.sync += [left.eq((period + ~halves[0]) >> 1), halves.eq(halves + (halves != wheel.most_halves))]
        return m
