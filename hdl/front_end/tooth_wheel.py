"""Wheels whose teeth make a pattern."""

import itertools

from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import Box
from tachometry.spec.core.tooth_wheel import ToothWheel


class _Wheel(Box):
    def __init__(self, wheel: ToothWheel) -> None:
        self._wheel = wheel
        super().__init__(
            tooth=In(1),  # high in the clock of a tooth, never in two clocks in a row
            filled=Out(1),  # high in the clock of a tooth of the full wheel, there or not
            index=Out(1),  # this tooth is the first one after the gap, the longest row or the extra tooth
            error=Out(1),  # this tooth is in the gap, or no extra one
            synced=Out(1),  # the place is known, from the clock after a tooth on
        )


class GapFiller(_Wheel):
    """Puts teeth where a wheel has none, and finds its gaps, see `ToothWheel`.

    Latency: none. What it finds of a tooth is in the clock of the tooth. A tooth that is put in is as many clocks after
    the one before as the latest two teeth in a row before the gap were apart.
    """

    def build(self, m: Module) -> None:
        wheel = self._wheel
        since = Signal(wheel.width, init=wheel.longest)  # clocks from the latest tooth on, at their end before any
        period = Signal.like(since, init=0)
        left = Signal(wheel.width)  # to the end of a half period
        halves = Signal(range(wheel.most_halves + 1))
        known = Signal()  # the period is of two teeth in a row
        long = Signal()
        here = Signal()  # the teeth up to a gap have come
        ends = Signal()
        found = Signal()
        late = Signal()  # this tooth is the first one after a gap
        latest = Signal.like(period)
        missing, fewest = (self._one_gap if len(wheel.gaps) == 1 else self._gaps)(m, here, late, halves)
        m.d.comb += [
            long.eq(since == wheel.longest),
            ends.eq(left == 1),
            found.eq(known & ~long & (halves != wheel.most_halves)),
            late.eq(self.tooth & (halves >= fewest) & Mux(self.synced, here, found)),
            self.error.eq(self.tooth & here & (halves < fewest)),
            self.filled.eq(self.tooth | (here & ends & halves[0] & (halves < 2 * missing))),
            latest.eq(Mux(self.tooth & ~late & ~long, since, period)),
        ]
        m.d.sync += [period.eq(latest), left.eq(left - 1), since.eq(Mux(self.tooth, 1, since + ~long))]
        with m.If(self.tooth):
            m.d.sync += [left.eq(latest >> 1), halves.eq(0)]
            with m.If(~late):
                m.d.sync += known.eq(~long)
        with m.Elif(ends):
            m.d.sync += [left.eq((period + ~halves[0]) >> 1), halves.eq(halves + (halves != wheel.most_halves))]

    def _one_gap(self, m: Module, here: Signal, late: Signal, halves: Signal) -> tuple[int, int]:
        """Return the teeth that are missing, and the half periods that the gap has at least; `late` is the index."""
        wheel = self._wheel
        place = Signal(range(wheel.teeth))  # teeth to come until the gap
        m.d.comb += [here.eq(self.synced & (place == 0)), self.index.eq(late)]
        m.d.sync += self.synced.eq(late | (self.synced & ~self.error))
        with m.If(self.tooth):
            m.d.sync += place.eq(Mux(late, wheel.teeth - 1, place - 1))
        return wheel.gaps[0], wheel.fewest_halves(wheel.gaps[0])

    def _gaps(self, m: Module, here: Signal, late: Signal, halves: Signal) -> tuple[Value, Value]:
        """Return the same of the gap to come; the index comes after the longest row of teeth of a turn."""
        wheel, most = self._wheel, max(self._wheel.gaps)
        row = Signal(range(wheel.teeth + 1))  # teeth since the latest gap
        rows = [Signal.like(row, name=f"row_{ago}", init=wheel.teeth) for ago, _ in enumerate(wheel.gaps, 1)]
        size = Signal(range(most + 1))  # of the gap that a late tooth ends
        sizes = [Signal.like(size, name=f"size_{ago}") for ago, _ in enumerate(wheel.gaps, 1)]
        with m.If(self.synced & (len(wheel.sizes) > 1)):
            m.d.comb += size.eq(sizes[-1])
        for smaller, larger in itertools.pairwise(wheel.sizes):
            with m.Elif(halves < 2 * larger + 1):
                m.d.comb += size.eq(smaller)
        with m.Else():
            m.d.comb += size.eq(most)
        fits = Signal()  # the rows of a turn have all teeth, and their gaps what is missing
        fewest = Mux(self.synced & (size > 1), size << 1, wheel.fewest_halves(wheel.sizes[0]))
        m.d.comb += [
            here.eq(self.synced & (row == rows[-1])),
            fits.eq((row + sum(rows[:-1]) == wheel.teeth) & (size + sum(sizes[:-1]) == sum(wheel.gaps))),
            self.index.eq(late & fits & ~Cat(row < other for other in rows[:-1]).any()),
        ]
        m.d.sync += self.synced.eq(Mux(late, fits, self.synced & ~self.error))
        with m.If(late):
            m.d.sync += [row.eq(1), *(into.eq(of) for into, of in zip(rows, [row, *rows], strict=False))]
            m.d.sync += [into.eq(of) for into, of in zip(sizes, [size, *sizes], strict=False)]
        with m.Elif(self.tooth & (row != wheel.teeth)):
            m.d.sync += row.eq(row + 1)
        return size, fewest


class ExtraDropper(_Wheel):
    """Finds the extra tooth of a wheel and leaves it out, see `ToothWheel`. Latency: none."""

    def build(self, m: Module) -> None:
        wheel = self._wheel
        since = Signal(wheel.width, init=wheel.longest)  # clocks from the latest tooth on that counts
        period = Signal(wheel.width)
        known = Signal(3)  # the latest three distances of teeth are known
        place = Signal(range(wheel.teeth))  # teeth to come until the extra one
        long = Signal()
        here = Signal()
        short = Signal()
        extra = Signal()  # this tooth is the extra one
        after = Signal()  # the next one is the first after it
        m.d.comb += [
            long.eq(since == wheel.longest),
            here.eq(self.synced & (place == 0) & ~after),
            short.eq((since << 2 < period + (period << 1)) & ~long),
            extra.eq(self.tooth & short & ~after & Mux(self.synced, here, known.all())),
            self.error.eq(self.tooth & here & ~short),
            self.index.eq(self.tooth & after),
            self.filled.eq(self.tooth & ~extra),
        ]
        m.d.sync += [
            since.eq(Mux(self.filled, 1, since + ~long)),
            self.synced.eq(self.index | (self.synced & ~self.error)),
            after.eq(extra | (after & ~self.tooth)),
        ]
        with m.If(self.filled):
            m.d.sync += [place.eq(Mux(after, wheel.teeth - 1, place - 1)), known.eq(Mux(long, 0, known << 1 | 1))]
            with m.If(~long):
                m.d.sync += period.eq(since)


def wheel_of(wheel: ToothWheel) -> GapFiller | ExtraDropper:
    """Return the box that makes a full wheel of this one."""
    return GapFiller(wheel) if wheel.gaps else ExtraDropper(wheel)
