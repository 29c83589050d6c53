"""The counts of a tick: their number, their times, their places."""

from itertools import accumulate

from amaranth import C, Cat, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from tachometry.hdl.arithmetic.idle import Idle, IdleSum
from tachometry.hdl.wires.ports import Box
from tachometry.spec.formats.displacement import DISPLACED
from tachometry.spec.formats.tracking import Tracking


def sums(*sums: tuple[Value, Value, Value]) -> list[Value]:
    """Return left + right + carry of each, modulo the width of left, out of one adder.

    Both ends of a carry chain take cells. Between two sums there is a bit that is the carry in both terms: so it comes
    into the second, and the carry of the first does not.
    """
    rights = [(C(0, signed(len(left))) | right)[: len(left)] for left, right, _ in sums]
    total = Cat(Cat(carry, left) for left, _, carry in sums) + Cat(
        Cat(carry, right) for right, (_, _, carry) in zip(rights, sums, strict=True)
    )
    ends = accumulate(len(left) + 1 for left, _, _ in sums)
    return [total[end - len(left) : end] for end, (left, _, _) in zip(ends, sums, strict=True)]


class TickCounts(Box):
    """Adds up times and places of the counts of each tick, valid from two clocks after it until the next ends."""

    def __init__(self, form: Tracking, max_ticks: int) -> None:
        self._form, self._max_ticks = form, max_ticks
        super().__init__(
            tick=In(1),  # the last clock of a tick
            step=In(signed(2)),
            **({} if (off := form.displacement) is None else self._mapped(form, signed(off.width))),
            number=Out(form.number_bits),  # counts that an event takes: the first ones
            times=Out(form.times_bits),  # sum of the clocks from each of these to the end of the tick
            # Sum of twice the places of their edges, in counts from the place at the beginning of the tick.
            places=Out(signed(form.places_bits)),
            kind=Out(2),  # lower one of both positions around the edge of the last of these, modulo 4
            down=Out(1),  # it went backward
            last=Out(range(form.longest_tick)),  # clocks from the last count to the end of the tick
            moved=Out(signed(form.moved_bits)),  # forward counts less backward ones
            end=Out(2),  # position at the end of the tick, since reset, modulo 4
            elapsed=Out(range(max_ticks + 1), init=max_ticks),  # ticks since the last one with counts before it
            length=Out(range(form.longest_tick + 1), init=form.tick_cycles),  # clocks of the tick
        )
        # Those of the tick that has not ended.
        self.open_number = Signal.like(self.number)
        self.open_times = Signal.like(self.times)
        self.open_places = Signal.like(self.places)
        self.open_kind = Signal.like(self.kind)
        self.open_down = Signal.like(self.down)
        self.open_last = Signal.like(self.last)
        self.open_moved = Signal.like(self.moved)

    @staticmethod
    def place(moved: Value, backward: Value, takes: Value) -> Value:
        """Return twice the place of a count that is taken, less one, behind counts that moved so far; else 0."""
        # A count backward has its place one below that of a count forward.
        lower = Cat(bit ^ (backward & ~moved[:at].any()) for at, bit in enumerate(moved))
        return Cat(C(0, 1), lower & takes.replicate(len(lower))).as_signed()

    @staticmethod
    def _mapped(form: Tracking, displacement: Shape) -> dict[str, Member]:
        """Return `DISPLACED`, the sum over the counts, and the displacements of the edges about the end."""
        shown = {"displacements": Out(signed(form.number_bits + displacement.width))}
        return dict.fromkeys(DISPLACED, In(displacement)) | shown | dict.fromkeys(("above", "below"), Out(displacement))

    @property
    def idle(self) -> tuple[Idle, ...]:
        """Sums that a simulation may move on: all are taken, and begin anew, with a tick or a count."""
        names = ("open_last", "open_times", *("open_length",) * self._form.external)
        return tuple(IdleSum(name) for name in names)

    def build(self, m: Module) -> None:
        number, moved, places = self.open_number, self.open_moved, self.open_places
        fresh = Signal()
        position = Signal(2)
        counts, backward = self.step.any(), self.step[-1]
        takes = Signal()
        m.d.comb += takes.eq(counts & (number != self._form.most_number))
        place = self.place(moved[: self._form.number_bits + 1], backward, takes)
        last, times, next_moved, next_places, waited = sums(
            (self.open_last, C(0, 1), C(1, 1)),
            (self.open_times, number & ~1, number[0]),
            (moved, backward.replicate(len(moved)), counts & ~backward),
            (places, place, takes),
            (self.elapsed, C(0, 1), self.elapsed != self._max_ticks),
        )
        m.d.sync += [
            fresh.eq(self.tick),
            position.eq(position + self.step),
            self.open_last.eq(Mux(counts, 0, last)),
            self.open_times.eq(Mux(fresh, 0, times)),
        ]
        with m.If(takes):
            m.d.sync += [self.open_kind.eq((position - backward)[:2]), self.open_down.eq(backward)]
        # These begin anew with the tick: as a reset of registers that takes no cells.
        next_number = number + takes
        m.d.sync += [number.eq(next_number), moved.eq(next_moved), places.eq(next_places)]
        with m.If(self.tick):
            m.d.sync += [
                *(value.eq(0) for value in (number, moved, places)),
                self.number.eq(next_number),
                self.moved.eq(next_moved),
                self.places.eq(next_places),
                self.elapsed.eq(Mux(self.number.any(), 1, waited)),
            ]
        self._show(m, fresh, position)
        self._displace(m, counts, takes)

    def _displace(self, m: Module, counts: Value, takes: Value) -> None:
        """Add up the displacements of the counts, and keep those of the edges about the end of the tick."""
        if self._form.displacement is None:
            return
        total = Signal.like(self.displacements)
        coming = Signal.like(total)
        was = Signal()  # the latest count went backward
        m.d.comb += coming.eq(total + Mux(takes, self.displaced, 0))
        m.d.sync += total.eq(coming)
        with m.If(counts):
            m.d.sync += was.eq(self.step[-1])
        with m.If(self.tick):
            latest, ahead = self.displaced_before, self.displaced
            m.d.sync += [total.eq(0), self.displacements.eq(coming)]
            m.d.sync += [self.above.eq(Mux(was, latest, ahead)), self.below.eq(Mux(was, ahead, latest))]

    def _show(self, m: Module, fresh: Signal, position: Signal) -> None:
        """Show the counts of the tick that has ended."""
        with m.If(fresh):
            m.d.sync += [
                self.times.eq(self.open_times),
                self.kind.eq(self.open_kind),
                self.down.eq(self.open_down),
                self.last.eq(self.open_last),
                self.end.eq(position),
            ]
        if self._form.external:
            length = Signal.like(self.length, name="open_length", init=1)
            m.d.sync += length.eq(length + 1)
            with m.If(self.tick):
                m.d.sync += [self.length.eq(length), length.eq(1)]
