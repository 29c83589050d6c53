"""What the golden models of the T and M/T methods share: counts and their times, silences, what the divider takes."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Table
from tachometry.spec.methods.timed import TimedTachometer
from tachometry.spec.tachometer import BOUNDS

Ints = NDArray[np.int64]


def chain(following: Ints) -> NDArray[np.bool_]:
    """Which of n places are met from place 0 on; `following[k]` > k is the next after k, n for none.

    All places that 2^i jumps reach are marked at once, for i = 0, 1, 2, …
    """
    n = len(following)
    jump = np.append(following, n)
    met = np.zeros(n + 1, dtype=np.bool_)
    met[0] = True
    while n and jump[0] < n:
        met[jump[met]] = True
        jump = jump[jump]
    return met[:n]


@dataclass(frozen=True)
class Counts:
    """All counts of a run; and its timer periods, numbered from 0, in each of which there is one count at most.

    Parameters
    ----------
    period : int64 array, shape (n,)
    size : int64 array, shape (n,)
        Counts of the step or of the tick; never 0.
    clock_of : int64 array, shape (m,), or None
        Clock in which each period is seen; None: a period is a clock.
    n_periods : int
    """

    period: Ints
    size: Ints
    clock_of: Ints | None
    n_periods: int

    @classmethod
    def of(cls, spec: TimedTachometer, ticks: Table, steps: Steps, n_clocks: int) -> "Counts":
        """The counts that the datapath sees within `n_clocks`: steps, or ticks that are not empty."""
        if spec.on_lattice:
            period = np.flatnonzero(ticks.pulse_count)
            return cls(period, ticks.pulse_count[period], ticks.clock, len(ticks.clock))
        seen = (steps.step != 0) & (steps.clock + spec.tick_latency < n_clocks)
        return cls(steps.clock[seen] + spec.tick_latency, steps.step[seen], None, n_clocks)

    def clock(self, period: Ints) -> Ints:
        """Clocks of some periods."""
        return period if self.clock_of is None else self.clock_of[period]

    @property
    def gap(self) -> Ints:
        """Periods from the count before to each count; reset is taken for one in period −1."""
        return np.diff(self.period, prepend=-1)

    def silences(self, max_periods: int) -> Ints:
        """Periods in which a 0 is forced."""
        begin = np.append(-1, self.period)
        end = np.append(self.period, self.n_periods)
        times = (end - begin - 1) // max_periods
        nth = np.arange(times.sum()) - np.repeat(np.cumsum(times) - times, times) + 1
        return np.repeat(begin, times) + nth * max_periods


@dataclass(frozen=True)
class Measurements:
    """What the divider is given, one row each, in order.

    Parameters
    ----------
    clock : int64 array, shape (n,)
    distance : int64 array, shape (n,), half counts
    time : int64 array, shape (n,), timer periods
    forced, beyond : bool arrays, shape (n,)
        `beyond`: out of range before any division.
    least, most : int64 arrays, shape (n, 2)
        Distance, in eighths of a count, and time for the least and for the greatest possible speed; time 0: that bound
        is absent.
    known : bool array, shape (n,)
        Whether `least` and `most` are valid.
    """

    clock: Ints
    distance: Ints
    time: Ints
    forced: NDArray[np.bool_]
    beyond: NDArray[np.bool_]
    least: Ints
    most: Ints
    known: NDArray[np.bool_]

    def __getitem__(self, rows: Any) -> "Measurements":
        return Measurements(*(column[rows] for column in vars(self).values()))

    def merged(self, other: "Measurements") -> "Measurements":
        """The rows of both, in order of their clocks."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        both = Measurements(*(np.concatenate(pair) for pair in pairs))
        return both[np.argsort(both.clock, kind="stable")]


def eighths(spec: TimedTachometer, counts: Any, side: int) -> Any:
    """Counts in eighths, with what edges may be off by on this side, −1 or 1."""
    return 8 * counts + side * int(8 * spec.edge_error)


def enclosure(spec: TimedTachometer, distance: Ints, time: Ints) -> tuple[Ints, Ints]:
    """`least` and `most` of distances between edges; each edge lies within a period before its count."""
    low, high = eighths(spec, distance, -1), eighths(spec, distance, 1)
    return (
        np.stack([low, np.where(low < 0, time - 1, time + 1)], axis=1),
        np.stack([high, np.where(high > 0, time - 1, time + 1)], axis=1),
    )


def with_silences(spec: TimedTachometer, counts: Counts, found: Measurements) -> Measurements:
    """The measurements, and a forced 0 for every silence."""
    period = counts.silences(spec.max_periods)
    none = np.zeros(len(period), dtype=np.int64)
    time = np.full(len(period), spec.max_periods)
    silent = Measurements(
        clock=counts.clock(period),
        distance=none,
        time=time,
        forced=none == 0,
        beyond=none > 0,
        # The shaft is between the same two edges at both ends.
        least=np.stack([eighths(spec, none - 1, -1), time], axis=1),
        most=np.stack([eighths(spec, none + 1, 1), time], axis=1),
        # The first period after reset was not seen completely.
        known=(np.arange(len(period)) > 0) | (period >= np.append(counts.period, counts.n_periods)[0]),
    )
    return found.merged(silent)


def rounded(spec: TimedTachometer, distance: Ints, time: Ints) -> tuple[Ints, NDArray[np.bool_]]:
    """Velocity in counts per tick of a distance in half counts, saturated, and whether that changed it."""
    exact = round_quotient(distance * spec.timer_periods, time, spec.native_frac_bits - 1)
    limit = spec.max_count << spec.native_frac_bits
    return np.clip(exact, -limit, limit), np.abs(exact) > limit


def _among(values: Ints, ordered: Ints) -> NDArray[np.bool_]:
    """Which of the values, none negative, stand in an ordered array; `np.isin` would sort or hash it."""
    return np.append(ordered, -1)[np.searchsorted(ordered, values)] == values


def _decaying(spec: TimedTachometer, counts: Counts, taken: Measurements, held: Ints, ticks: Table) -> Measurements:
    """Ticks at which the velocity decays; `held` is the velocity after each measurement.

    A tick in whose window no count came compares, if nothing is being divided. A measurement that begins meanwhile
    takes the divider.
    """
    through = np.searchsorted(counts.clock(counts.period), ticks.clock, side="right")
    ask = ticks.clock[(np.diff(through, prepend=0) == 0) & ~_among(ticks.clock, taken.clock)]
    clock = np.append(taken.clock, ask)
    order = np.argsort(clock)
    clock, measured = clock[order], order < len(taken.clock)
    at, n = np.flatnonzero(measured), len(clock)
    next_measured = np.append(at, n)[np.searchsorted(at, np.arange(n), side="right")]
    following = np.minimum(np.searchsorted(clock, clock + spec.datapath_latency), next_measured)
    in_time = np.append(clock, np.iinfo(np.int64).max)[next_measured] >= clock + spec.division_clocks
    asked = np.flatnonzero(chain(following) & ~measured & in_time)
    last = np.searchsorted(at, asked) - 1  # the measurement before
    asked, last = asked[last >= 0], last[last >= 0]
    velocity, clock = held[last], clock[asked]

    period = np.searchsorted(ticks.clock, clock) if spec.on_lattice else clock
    age = period - np.append(-1, counts.period)[np.searchsorted(counts.period, period)]
    # An edge may lie half a count off: the silence allows 1½ counts.
    sign = np.where(velocity < 0, -1, 1)
    greatest = np.abs(rounded(spec, 3 * sign, age)[0])
    # Least magnitude that the velocity had since the measurement, before each: of ranks, which later measurements beat.
    _, rank = np.unique(greatest, return_inverse=True)
    least = np.minimum.accumulate(rank - last * (len(rank) + 1)) + last * (len(rank) + 1)
    first = np.append(True, last[1:] != last[:-1])[: len(last)]
    nearer = (greatest < np.abs(velocity)) & (first | (rank < np.roll(least, 1)))
    none = np.zeros(len(clock), dtype=np.bool_)
    last_size = np.append(0, counts.size)[np.searchsorted(counts.period, period)]
    # The shaft is no farther back than its last edge.
    least = np.stack([eighths(spec, np.where((sign > 0) & (last_size > 0), 0, -1), -1), age], axis=1)
    most = np.stack([eighths(spec, np.where((sign < 0) & (last_size < 0), 0, 1), 1), age], axis=1)
    return Measurements(clock, 3 * sign, age, ~none, none, least, most, ~none)[nearer]


def updates(spec: TimedTachometer, counts: Counts, taken: Measurements, ticks: Table) -> Table:
    """All updates with the velocity in counts per tick, as the datapath shows it."""
    # A forced 0 takes the divider, if ticks are so short that it is still at work.
    finished = np.diff(taken.clock, append=np.iinfo(np.int64).max) >= spec.division_clocks
    shown = taken[finished]
    if spec.decays:
        held = rounded(spec, taken.distance, taken.time)[0]
        shown = shown.merged(_decaying(spec, counts, taken, held, ticks))
    velocity, saturated = rounded(spec, shown.distance, shown.time)
    columns = {
        "velocity": velocity,
        "interval": shown.time,
        "forced": shown.forced,
        "out_of_range": saturated | shown.beyond,
    }
    return Table(shown.clock + spec.datapath_latency, columns | (_bounds(spec, shown) if spec.bounds else {}))


def _bounds(spec: TimedTachometer, taken: Measurements) -> dict[str, NDArray[Any]]:
    """Bounds of the velocity in counts per tick, rounded outward."""
    found: dict[str, NDArray[Any]] = {"bounds_valid": taken.known}
    for (name, towards), ends in zip(BOUNDS.items(), (taken.least, taken.most), strict=True):
        distance, time = ends.T
        exact = round_quotient(distance * spec.timer_periods, 8 * np.maximum(time, 1), spec.native_frac_bits, towards)
        found[name] = np.where(time > 0, exact, towards * spec.absent_bound)
    return found
