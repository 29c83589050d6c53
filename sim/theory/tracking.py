"""The tracking recursion of docs/concepts/track.md in double precision, and in real units: counts, seconds, rad/s.

It knows nothing of words, shifts and programs. What it takes from a spec are its options, the length of the ticks, the
greatest speed and the delay to the port.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.theory.checks import Floats
from tachometry.spec import TrackTachometer

_LEVELS = 16
_LEVELS_BACK = 4
_AGILE = 4
_SHORTEST_MEMORY = 0.2
_GROWTH = 10


class Phase(Enum):
    """Says how many counts are known."""

    REST = 0
    ONE = 1
    TRACKS = 2


@dataclass(frozen=True, kw_only=True)
class Tuning:
    """Holds the numbers that the recursion depends on.

    Parameters
    ----------
    bandwidth : float, rad/s
        λ_0.
    least_memory : float
        θ_min at λ_0.
    edge_error : float, counts
        E.
    agile, growing : bool
        Whether it has the agile gains, and whether λ falls.
    clock_seconds, tick_seconds : float
        A clock, and a tick of nominal length.
    max_ticks, max_count : int
        Ticks without a count after which it rests, and most counts of a tick.
    unit_seconds : float
        The time in which the acceleration changes the speed by at most an eighth of the greatest one.
    lead_seconds : float
        Time from an edge in the last clock of a tick to the clock in which the velocity is shown.
    """

    bandwidth: float
    least_memory: float
    edge_error: float
    agile: bool
    growing: bool
    clock_seconds: float
    tick_seconds: float
    max_ticks: int
    max_count: int
    unit_seconds: float
    lead_seconds: float

    @classmethod
    def of(cls, spec: TrackTachometer) -> "Tuning":
        """Return those of a core."""
        clock_hz, bandwidth = spec.timing.clock_hz, float(spec.bandwidth)
        # A power of two clocks: a quarter of 1/λ_0, or half the longest tick, whichever is more.
        bits = max(math.floor(math.log2(clock_hz / (4 * bandwidth))), math.floor(math.log2(spec.times.longest_tick)))
        delay = spec.latency.pin_to_count + spec.latency.tick + spec.latency.tick_to_velocity
        return cls(
            bandwidth=bandwidth,
            least_memory=float(spec.least_memory),
            edge_error=float(spec.edge_error),
            agile=spec.agile,
            growing=spec.growing_memory,
            clock_seconds=1 / clock_hz,
            tick_seconds=float(spec.timing.tick_seconds),
            max_ticks=spec.timing.max_ticks,
            max_count=spec.widths.max_count,
            unit_seconds=2.0**bits / clock_hz,
            lead_seconds=min(delay, 2 * 2**bits - 1) / clock_hz,
        )

    @property
    def shortest_gap(self) -> float:
        """Seconds, whole clocks, between the first two counts: less is taken for so much."""
        tick_cycles = round(self.tick_seconds / self.clock_seconds)
        return max(tick_cycles // self.max_count, 1) * self.clock_seconds

    @property
    def greatest_velocity(self) -> float:
        """Counts per second."""
        return self.max_count / self.tick_seconds

    @property
    def greatest_acceleration(self) -> float:
        """Counts per second²."""
        return self.greatest_velocity / (8 * self.unit_seconds)

    def rate(self, level: int) -> float:
        """Return λ of a level, rad/s."""
        return float(self.bandwidth * 10 ** (-level / (_LEVELS - 1)))

    def reach(self, level: int) -> float:
        """Return the greatest λ·m·T_s of a level: −ln θ_min."""
        return -math.log(1 - (1 - self.least_memory) * max(10 ** (-level / (_LEVELS - 1)), _SHORTEST_MEMORY))

    def span(self, level: int) -> float:
        """Return seconds without trouble from a level to the next one.

        λ falls by its e-th part in ten of its time constants, so dλ/dt = −λ²/10, and 1/λ grows by a tenth of the time.
        A level is taken when λ has fallen to the geometric mean of its rate and of that before.
        """
        if level == _LEVELS - 1:
            return math.inf

        def taken(later: int) -> float:
            if not later:
                return 0.0
            return _GROWTH * (1 / math.sqrt(self.rate(later - 1) * self.rate(later)) - 1 / self.bandwidth)

        return taken(level + 1) - taken(level)


@dataclass(frozen=True)
class Tracked:
    """Holds the outputs of the recursion at the end of every tick, shape (n,) each.

    Parameters
    ----------
    velocity : counts per second, in the clock in which it is shown
    acceleration : counts per second²
    place : counts, from the position at the end of the tick
    level : of λ
    """

    velocity: Floats
    acceleration: Floats
    place: Floats
    level: NDArray[np.int64]


@dataclass
class Recursion:
    """Keeps the state, and changes it in every tick.

    Parameters
    ----------
    tuning : Tuning
    """

    tuning: Tuning
    place: float = 0.0
    velocity: float = 0.0
    acceleration: float = 0.0
    phase: Phase = Phase.REST
    phases: deque[Phase] = field(default_factory=lambda: deque([Phase.REST] * 2, maxlen=2))
    silent: int = 0  # ticks without a count
    gap: float = 0.0  # s, to the end of this tick
    mean_error: float = 0.0
    error_before: float = 0.0
    untroubled: float = 0.0  # s
    level: int = 0

    def __post_init__(self) -> None:
        self.silent = self.tuning.max_ticks

    def reaches(self, value: float, limit: float) -> bool:
        """Tell whether a value is as great as a limit: every decision of the recursion that rounding could turn."""
        return value >= limit

    def tick(self, length: float, ages: list[float], steps: list[int], offsets: list[float] | None = None) -> None:
        """Take a tick of `length` seconds, whose counts `steps` came `ages` seconds before its end.

        With `offsets` the edges of the counts lie so many counts from where those of a perfect disc lie.
        """
        tuning = self.tuning
        self.gap += length
        self.place += self.velocity * length + self.acceleration * length**2 / 2
        self.velocity += self.acceleration * length
        alone = self.silent > 0 or self.phases[0] is not Phase.TRACKS or len(steps) > tuning.max_count
        self.silent = 0 if steps else self.silent + 1
        if steps:
            # The edge of a count lies in the middle between the positions before and after it.
            after = np.cumsum(steps[::-1])[::-1] - np.array(steps)
            edges = (-after - np.array(steps) / 2 + (0 if offsets is None else offsets)).tolist()
            if alone:
                ages, edges = ages[-1:], edges[-1:]
            if self.phase is Phase.REST and len(edges) > 1:  # just begun anew: none of them is the first
                self._rest()
            else:
                self._count(sum(ages) / len(ages), sum(edges) / len(edges), sum(steps))
        elif self.silent >= tuning.max_ticks:
            self._rest()
        else:
            self._wait()
        self.phases.append(self.phase)
        greatest = tuning.greatest_velocity
        self.velocity = min(max(self.velocity, -greatest), greatest)
        greatest = tuning.greatest_acceleration
        self.acceleration = min(max(self.acceleration, -greatest), greatest)

    @property
    def shown_velocity(self) -> float:
        """Counts per second in the clock in which it is shown."""
        greatest = self.tuning.greatest_velocity
        return min(max(self.velocity + self.acceleration * self.tuning.lead_seconds, -greatest), greatest)

    def _forget(self) -> None:
        self.gap = self.mean_error = self.error_before = self.untroubled = 0.0
        self.level = 0

    def _rest(self) -> None:
        self._forget()
        self.place = self.velocity = self.acceleration = 0.0
        self.phase = Phase.REST

    def _count(self, age: float, edge: float, moved: int) -> None:
        tuning = self.tuning
        if abs(moved) > tuning.max_count:
            self._forget()
            self.place = self.acceleration = 0.0
            self.velocity = math.copysign(tuning.greatest_velocity, moved)
            self.phase = Phase.TRACKS
        elif self.phase is Phase.REST:
            self._forget()
            self.place, self.velocity, self.acceleration, self.gap = edge, 0.0, 0.0, age
            self.phase = Phase.ONE
        elif self.phase is Phase.ONE:
            speed = (edge - self.place + moved) / max(self.gap - age, tuning.shortest_gap)
            self._forget()
            self.velocity = min(max(speed, -tuning.greatest_velocity), tuning.greatest_velocity)
            self.place, self.acceleration = edge + self.velocity * age, 0.0
            self.phase = Phase.TRACKS
        else:
            self.place -= moved
            error = edge - (self.place - self.velocity * age)
            if self.reaches(abs(error), 2 * tuning.max_count + 2):
                self._rest()
            else:
                self._correct(error)

    def _correct(self, error: float) -> None:
        tuning = self.tuning
        agile = tuning.agile and self._is_large(error)
        self.error_before = error
        if tuning.growing:
            self._remember(error, agile)
        rate = _AGILE * tuning.bandwidth if agile else tuning.rate(self.level)
        x = min(rate * self.gap, tuning.reach(0 if agile else self.level))
        d = x / (1 + x / 2 + x * x / 12)  # 1 − e^−x
        self.place += (1 - (1 - d) ** 3) * error
        self.velocity += 1.5 * (1 - (1 - d) ** 2) * d * error / self.gap
        self.acceleration += d**3 * error / self.gap**2
        self.gap = 0.0

    def _is_large(self, error: float) -> bool:
        limit = self.tuning.edge_error
        if self.reaches(abs(error), 2 * limit):
            return True
        same = math.copysign(1, error) * self.error_before
        return self.reaches(abs(error), limit) and self.reaches(same, limit / 4)

    def _remember(self, error: float, agile: bool) -> None:
        tuning = self.tuning
        share = min(tuning.rate(self.level) * self.gap, tuning.reach(self.level)) / 4
        self.mean_error += (error - self.mean_error) * share
        self.untroubled += self.gap
        if agile:
            self.untroubled, self.level = 0.0, 0
        elif self.reaches(self.mean_error**2, (tuning.edge_error / 4) ** 2 * share):
            self.mean_error /= 2
            self.untroubled, self.level = 0.0, max(self.level - _LEVELS_BACK, 0)
        elif self.reaches(self.untroubled, tuning.span(self.level)):
            self.untroubled, self.level = 0.0, self.level + 1

    def _wait(self) -> None:
        """Keep the place near the position without a count, and let a speed fall that leads away from it."""
        limit = 0.5 + 1.5 * self.tuning.edge_error
        if not self.reaches(abs(self.place), limit):
            return
        sign = math.copysign(1, self.place)
        self.place = sign * limit
        if sign * self.velocity >= 0:
            self.velocity = sign * min(abs(self.velocity), 1 / self.gap)
            self.acceleration = sign * min(sign * self.acceleration, 0.0)


def track(
    tuning: Tuning,
    clock: NDArray[np.int64],
    step: NDArray[np.int64],
    last: NDArray[np.int64],
    recursion: Recursion | None = None,
) -> Tracked:
    """Return the recursion over all ticks.

    Parameters
    ----------
    tuning : Tuning
    clock, step : int64 arrays, shape (k,)
        The counts: their clocks, not decreasing, and −1 or +1.
    last : int64 array, shape (n,)
        Last clock of each tick.
    recursion : Recursion or None
        Where to begin; None: at rest.
    """
    state = Recursion(tuning) if recursion is None else recursion
    second = tuning.clock_seconds
    until = np.searchsorted(clock, last, side="right").tolist()
    rows, begin, before = [], 0, -1
    for end, now in zip(until, last.tolist(), strict=True):
        ages = [(now - at) * second for at in clock[begin:end].tolist()]
        state.tick((now - before) * second, ages, step[begin:end].tolist())
        rows.append((state.shown_velocity, state.acceleration, state.place, state.level))
        begin, before = end, now
    velocity, acceleration, place, level = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return Tracked(velocity, acceleration, place, level.astype(np.int64))
