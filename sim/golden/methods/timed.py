"""The golden models of T and M/T share this: counts and their times, silences, and the operands of the divider."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.golden.sorted_lookup import chain, next_place, places, spans
from tachometry.sim.signals.run import Table
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.methods.timed import TimedTachometer

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Counts:
    """Holds all counts of a run, and its timer periods from 0 on, in each of which there is one count at most."""

    period: Ints  # shape (n,)
    size: Ints  # shape (n,): counts of the step or of the tick; never 0
    place: Ints  # shape (n,): how far off its place the edge lies, in counts, times the timer periods in a tick
    mapped: NDArray[np.bool_]  # shape (n,): whether that is known, or there is no map
    clock_of: Ints | None  # shape (m,): clock in which each period is seen; None: a period is a clock
    n_periods: int
    before: int = -1  # period of the count before the first; reset is taken for one in period −1
    fresh: bool = True  # whether the first count is the first after reset

    @classmethod
    def of(cls, spec: TimedTachometer, ticks: Table, steps: Steps, n_clocks: int) -> "Counts":
        """Return the steps that the datapath counts within `n_clocks`, or the ticks that are not empty."""
        if spec.form.on_lattice:
            period = np.flatnonzero(ticks.pulse_count)
            return cls(period, ticks.pulse_count[period], 0 * period, period >= 0, ticks.clock, len(ticks.clock))
        seen = (steps.step != 0) & (steps.clock + spec.latency.tick < n_clocks)
        form, period = spec.displacement, steps.clock[seen] + spec.latency.tick
        if form is None:
            return cls(period, steps.step[seen], 0 * period, period >= 0, None, n_clocks)
        return cls(period, steps.step[seen], steps.displaced[seen] << form.low, steps.mapped[seen], None, n_clocks)

    def clock(self, period: Ints) -> Ints:
        """Return clocks of some periods."""
        return period if self.clock_of is None else self.clock_of[period]

    @property
    def gap(self) -> Ints:
        """Periods from the count before to each count."""
        return np.diff(self.period, prepend=self.before)

    def mapped_before(self, spec: TimedTachometer, period: Ints) -> NDArray[np.bool_]:
        """Return whether a map, if there is one, was used at the last count before each of some periods."""
        return np.append(spec.displacement is None, self.mapped)[np.searchsorted(self.period, period)]

    def silences(self, max_periods: int) -> Ints:
        """Return periods in which a 0 is forced."""
        begin = np.append(self.before, self.period)
        end = np.append(self.period, self.n_periods)
        long = np.flatnonzero(end - begin > max_periods)
        nth, row = spans(np.ones_like(long), 1 + (end[long] - begin[long] - 1) // max_periods)
        return begin[long[row]] + nth * max_periods


@dataclass(frozen=True)
class Measurements:
    """Holds the operands of the divider, one row each, in order."""

    clock: Ints  # shape (n,)
    distance: Ints  # shape (n,), half counts
    displaced: Ints  # shape (n,): what the edges add to it, in counts, times the timer periods in a tick
    time: Ints  # shape (n,), timer periods
    # shape (n,): the maximum time has ended it; out of range before any division
    forced: NDArray[np.bool_]
    beyond: NDArray[np.bool_]
    # shape (n, 2): 8 times the distance, as `displaced`, and time for the least and for the greatest possible speed;
    # time 0: that bound is absent. None if the core shows no bounds.
    least: Ints | None
    most: Ints | None
    known: NDArray[np.bool_]  # shape (n,): whether `least` and `most` are valid
    opening: Ints  # shape (n,): the count that opened it; of a silence, the one after it

    def __getitem__(self, rows: Any) -> "Measurements":
        columns: dict[str, Any] = {
            name: None if column is None else column[rows] for name, column in vars(self).items()
        }
        return Measurements(**columns)

    def with_more(self, more: "Measurements") -> "Measurements":
        """Return the rows of both in order of their clocks; `more`, which are few, after those of the same clock."""
        at = np.searchsorted(self.clock, more.clock, side="right")
        columns: dict[str, Any] = {
            name: None if own is None else np.insert(own, at, vars(more)[name], axis=0)
            for name, own in vars(self).items()
        }
        return Measurements(**columns)


def eighths(spec: TimedTachometer, way: Any, side: int) -> Any:
    """Return 8 times a way, as `displaced`, with what edges may be off by on this side, −1 or 1."""
    return 8 * way + side * int(8 * spec.bound.edge_error) * spec.form.timer_periods


def enclosure(spec: TimedTachometer, distance: Ints, off: Ints, time: Ints) -> tuple[Ints, Ints] | tuple[None, None]:
    """Return `least` and `most` of distances between edges; each edge lies within a period before its count."""
    if not spec.bounds:
        return None, None
    way = distance * spec.form.timer_periods + off
    low, high = eighths(spec, way, -1), eighths(spec, way, 1)
    return (
        np.stack([low, np.where(low < 0, time - 1, time + 1)], axis=1),
        np.stack([high, np.where(high > 0, time - 1, time + 1)], axis=1),
    )


def _between(spec: TimedTachometer, back: Ints, on: Ints, time: Ints) -> tuple[Ints, Ints] | tuple[None, None]:
    """Return `least` and `most` of a shaft that may have gone so many counts back or on, in just this time."""
    if not spec.bounds:
        return None, None
    way = spec.form.silent_way
    return np.stack([eighths(spec, back * way, -1), time], axis=1), np.stack([eighths(spec, on * way, 1), time], axis=1)


def with_silences(spec: TimedTachometer, counts: Counts, found: Measurements) -> Measurements:
    """Return the measurements, and a forced 0 for every silence."""
    period = counts.silences(spec.form.max_periods)
    none = np.zeros(len(period), dtype=np.int64)
    time = np.full(len(period), spec.form.max_periods)
    # The shaft is between the same two edges at both ends.
    least, most = _between(spec, none - 1, none + 1, time)
    silent = Measurements(
        clock=counts.clock(period),
        distance=none,
        displaced=none,
        time=time,
        forced=none == 0,
        beyond=none > 0,
        least=least,
        most=most,
        # The first period after reset was not seen completely.
        known=((np.arange(len(period)) >= counts.fresh) | (period >= np.append(counts.period, counts.n_periods)[0]))
        & counts.mapped_before(spec, period),
        opening=np.searchsorted(counts.period, period),
    )
    return found.with_more(silent)


def rounded(spec: TimedTachometer, distance: Ints, time: Ints, off: Ints | int = 0) -> tuple[Ints, NDArray[np.bool_]]:
    """Return velocity in counts per tick of a distance in half counts, saturated, and whether that changed it."""
    exact = round_quotient(distance * spec.form.timer_periods + 2 * off, time, spec.velocity.native_frac_bits - 1)
    limit = spec.tick.max_count << spec.velocity.native_frac_bits
    return np.clip(exact, -limit, limit), np.abs(exact) > limit


def _asking(spec: TimedTachometer, counts: Counts, taken: Measurements, held: Ints, ticks: Table) -> tuple[Ints, Ints]:
    """Return ticks that compare, and the measurement before each, of those measurements whose velocity may decay.

    A tick in whose window no count came compares, if nothing is being divided. A measurement that begins meanwhile
    takes the divider.
    """
    end = np.append(taken.clock, np.iinfo(np.int64).max)[1:]
    # A velocity that is not 0 was measured at a count, so no silence is longer than the time up to the next one.
    latest = np.minimum(end, np.append(0, ticks.clock)[-1] + 1)
    longest = latest - taken.clock
    if spec.form.on_lattice:
        longest = places(ticks.clock, latest, "left") - places(ticks.clock, taken.clock, "left")
    may = np.flatnonzero(np.abs(_greatest(spec, held, np.maximum(longest, 1))) < np.abs(held))
    first = np.searchsorted(ticks.clock, taken.clock[may], side="right")
    tick, row = spans(first, np.searchsorted(ticks.clock, end[may]))
    counted = counts.clock(counts.period)
    before = np.append(-1, ticks.clock)[tick]
    empty = np.searchsorted(counted, ticks.clock[tick], side="right") == np.searchsorted(counted, before, side="right")
    asked, row = ticks.clock[tick[empty]], row[empty]
    # From each such measurement on, one after the other.
    clock = np.append(taken.clock[may], asked)
    order = np.argsort(clock)
    clock, measured = clock[order], order < len(may)
    following = np.minimum(
        np.searchsorted(clock, clock + spec.latency.datapath), next_place(np.flatnonzero(measured), len(clock))
    )
    met = np.empty_like(measured)
    met[order] = chain(following)
    last = may[row]
    compares = met[len(may) :] & (end[last] >= asked + spec.form.division_clocks)
    return asked[compares], last[compares]


def _greatest(spec: TimedTachometer, velocity: Ints, age: Ints) -> Ints:
    """Return the greatest velocity of a sign after a silence; an edge may lie half a count off, so 1½ counts."""
    return rounded(spec, 3 * np.where(velocity < 0, -1, 1), age)[0]


def _decaying(spec: TimedTachometer, counts: Counts, taken: Measurements, held: Ints, ticks: Table) -> Measurements:
    """Return ticks at which the velocity decays; `held` is the velocity after each measurement."""
    clock, last = _asking(spec, counts, taken, held, ticks)
    velocity = held[last]
    period = np.searchsorted(ticks.clock, clock) if spec.form.on_lattice else clock
    age = period - np.append(-1, counts.period)[np.searchsorted(counts.period, period)]
    sign = np.where(velocity < 0, -1, 1)
    greatest = np.abs(_greatest(spec, velocity, age))
    # Least magnitude that the velocity had since the measurement, before each: of ranks, which later measurements beat.
    _, rank = np.unique(greatest, return_inverse=True)
    least = np.minimum.accumulate(rank - last * (len(rank) + 1)) + last * (len(rank) + 1)
    first = np.append(True, last[1:] != last[:-1])[: len(last)]
    nearer = (greatest < np.abs(velocity)) & (first | (rank < np.roll(least, 1)))
    none = np.zeros(len(clock), dtype=np.bool_)
    last_size = np.append(0, counts.size)[np.searchsorted(counts.period, period)]
    # The shaft is no farther back than its last edge.
    back = np.where((sign > 0) & (last_size > 0), 0, -1)
    low, high = _between(spec, back, np.where((sign < 0) & (last_size < 0), 0, 1), age)
    known = counts.mapped_before(spec, period)
    return Measurements(clock, 3 * sign, 0 * sign, age, ~none, none, low, high, known, 0 * sign)[nearer]


def updates(spec: TimedTachometer, counts: Counts, taken: Measurements, ticks: Table) -> Table:
    """Return all updates with the velocity in counts per tick, as the datapath shows it."""
    # A forced 0 takes the divider, if ticks are so short that it is still at work.
    finished = np.diff(taken.clock, append=np.iinfo(np.int64).max) >= spec.form.division_clocks
    held, saturated = rounded(spec, taken.distance, taken.time, taken.displaced)
    shown = _shown(spec, taken, held, saturated).rows(finished)
    if spec.form.decays:
        slower = _decaying(spec, counts, taken, held, ticks)
        more = _shown(spec, slower, *rounded(spec, slower.distance, slower.time))
        at = np.searchsorted(shown.clock, more.clock)
        columns = {name: np.insert(column, at, more[name]) for name, column in shown.columns.items()}
        shown = Table(np.insert(shown.clock, at, more.clock), columns)
    return shown


def _shown(spec: TimedTachometer, taken: Measurements, velocity: Ints, saturated: NDArray[np.bool_]) -> Table:
    """Return measurements as updates."""
    columns = {
        "velocity": velocity,
        "interval": taken.time,
        "forced": taken.forced,
        "out_of_range": saturated | taken.beyond,
    }
    return Table(taken.clock + spec.latency.datapath, columns | (_bounds(spec, taken) if spec.bounds else {}))


def _bounds(spec: TimedTachometer, taken: Measurements) -> dict[str, NDArray[Any]]:
    """Return bounds of the velocity in counts per tick, rounded outward."""
    found: dict[str, NDArray[Any]] = {"bounds_valid": taken.known}
    for (name, towards), ends in zip(BOUNDS.items(), (taken.least, taken.most), strict=True):
        assert ends is not None
        distance, time = ends.T
        exact = round_quotient(distance, 8 * np.maximum(time, 1), spec.velocity.native_frac_bits, towards)
        found[name] = np.where(time > 0, exact, towards * spec.velocity.absent_bound)
    return found


class TimedModel:
    """Computes a method with a divider.

    Between two calls it keeps counts and ticks from the last measurement on that can show nothing more of those before
    it, and measures them anew.
    """

    def __init__(self, spec: Any) -> None:
        self._spec = spec
        self._since = self._n_clocks = 0  # clock of that measurement; clocks of all calls
        self._known = -1  # clock of the last step
        self._before, self._fresh = -1, True  # see `Counts`
        self._kept: tuple[Table, Steps] | None = None

    def taken(self, counts: Counts, since: int) -> Measurements:
        """Return what the divider takes from a clock on, in which it has taken a measurement or the core begins."""
        raise NotImplementedError

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return the next updates below `n_clocks` clocks, with the velocity in counts per tick as the datapath has it.

        `steps` may have some that are known already.
        """
        spec, begin = self._spec, self._n_clocks
        if self._kept is not None:
            ticks, steps = self._kept[0].then(ticks), self._kept[1].then(steps.part(self._known + 1))
        self._known = int(np.append(self._known, steps.clock)[-1])
        counts = replace(Counts.of(spec, ticks, steps, n_clocks), before=self._before, fresh=self._fresh)
        taken = self.taken(counts, self._since)
        found = updates(spec, counts, taken, ticks)
        self._keep(counts, taken, ticks, steps, n_clocks)
        return found.rows(slice(*np.searchsorted(found.clock, (begin, n_clocks))))

    def _keep(self, counts: Counts, taken: Measurements, ticks: Table, steps: Steps, n_clocks: int) -> None:
        """Keep what the next call needs."""
        spec, self._n_clocks = self._spec, n_clocks
        last = int(np.searchsorted(taken.clock, n_clocks - spec.latency.datapath, side="right")) - 1
        if last >= 1:
            self._since, self._fresh = int(taken.clock[last]), False
            row, first = int(taken.opening[last]), int(np.searchsorted(ticks.clock, self._since))
            begin = first if spec.form.on_lattice else self._since
            if taken.forced[last]:
                self._before = begin - spec.form.max_periods
            else:
                self._before, begin = int(np.append(self._before, counts.period)[row]), int(counts.period[row])
            if spec.form.on_lattice:
                self._before, first = self._before - begin, begin
            ticks, steps = ticks.rows(slice(first, None)), steps.part(begin - spec.latency.tick)
        self._kept = ticks, steps
