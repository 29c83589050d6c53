"""Four methods in use are modelled in floats, from their published descriptions.

Each reads the encoder once per control period and gives a speed that holds until the next reading. Readings are at
period, 2 periods, ..., or in step with the instants at which a loop reads the speed. Finite differences and the
low-pass filter are as in SimpleFOC's documentation of its velocity filter, the timestamp method is that of LinuxCNC's
hostmot2 driver (its manual page and driver), the mixed method that of SimpleFOC's encoder, and the tracking loop that
of ODrive and of moteus. The models are at rest at time 0, at count 0.
"""

import math
from dataclasses import dataclass, field
from fractions import Fraction
from itertools import accumulate
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.golden.front_end import counted
from tachometry.sim.signals.recording import MAX_TICKS, Recording
from tachometry.spec import Encoder
from tachometry.spec.language.units import short_time

IntArray = NDArray[np.int64]

MOTEUS_3DB_RATIO = 2.48
"""3 dB frequency over natural frequency of a critically damped tracking loop, as moteus rounds it."""


@dataclass(frozen=True, eq=False)
class Steps:
    """Holds the counts of an encoder, one by one."""

    time: FloatArray  # shape (n,), seconds, from 0 to `duration`, not decreasing
    step: IntArray  # shape (n,), +1 or -1
    duration: float  # seconds: length of the recording
    counts_per_rev: Fraction | int
    reads: FloatArray = field(default_factory=lambda: np.empty(0))  # shape (n,), seconds: when a loop reads the speed
    clock_s: float = 1e-7  # seconds: unit of timestamps
    # of an encoder that is read: its positions at `reads`, how old they are, and what is between two reads; no steps
    taken: IntArray | None = None
    age_s: float = 0.0
    tick_s: float = 0.0

    def __post_init__(self) -> None:
        if len(self.time) != len(self.step) or np.any(np.abs(self.step) != 1):
            raise ValueError("steps must be +1 or -1, one for each time")
        bounded = np.concatenate([[0.0], self.time, [self.duration]])
        if not np.all(np.diff(bounded) >= 0):
            raise ValueError(f"times of steps must not decrease, from 0 to the duration, {self.duration} s")
        if self.counts_per_rev < 1:
            raise ValueError(f"counts_per_rev must be at least 1, not {self.counts_per_rev}")

    @staticmethod
    def of_sensor(recording: Recording, encoder: Encoder) -> "Steps":
        """Return what an ideal decoder of a sensor counts."""
        step, _ = counted(encoder, recording.lines)
        row = np.flatnonzero(step)
        return Steps(recording.time[row], step[row], recording.duration, encoder.counts_per_rev)

    @property
    def count_rad(self) -> float:
        """Angle of one count, rad."""
        return 2 * math.pi / self.counts_per_rev


@dataclass(frozen=True, eq=False)
class Estimate:
    """Holds a measured speed."""

    time: FloatArray  # shape (n,), seconds, increasing
    velocity: FloatArray  # shape (n,), rad/s: holds from `time` on, until the next one

    def at(self, t: ArrayLike) -> FloatArray:
        """Return speed in rad/s that holds at times `t` in seconds, up to rounding; 0 before the first."""
        return np.append(0.0, self.velocity)[np.searchsorted(self.time, np.multiply(t, 1 + 1e-12), side="right")]


class Readings(NamedTuple):
    """Holds the readings of a controller, one per control period."""

    time: FloatArray  # shape (n,), seconds
    counts: IntArray  # shape (n,)
    changed_at: FloatArray  # shape (n,), seconds: of the latest step, 0 before the first

    @property
    def difference(self) -> IntArray:
        """Counts since the reading before."""
        return np.diff(self.counts, prepend=0)


def read(steps: Steps, period_s: float | None) -> Readings:
    """Return readings at `period_s`, twice that, ..., up to the end; in step with the reads of a loop, if it has any.

    Without a period (s) they are at these reads. It raises ValueError if the period is not more than 0, or there were
    more than `MAX_TICKS` readings.
    """
    if period_s is None or steps.taken is not None:
        return _readings(steps, steps.reads)
    if not period_s > 0:
        raise ValueError(f"control period must be more than 0 s, not {short_time(period_s)}")
    if not steps.duration / period_s <= MAX_TICKS:
        raise ValueError(
            f"what is compared must have at most {MAX_TICKS} control periods of {period_s:g} s: shorten it"
        )
    phase = float(steps.reads[0] % period_s) if len(steps.reads) else 0.0
    n_periods = math.floor((steps.duration - phase) / period_s * (1 + 1e-12))
    return _readings(steps, phase + period_s * np.arange(1, n_periods + 1, dtype=np.float64))


def _readings(steps: Steps, time: FloatArray) -> Readings:
    if steps.taken is not None:
        return Readings(time, steps.taken, time - steps.age_s)
    seen = np.searchsorted(steps.time, time, side="right")
    count = np.append(0, np.cumsum(steps.step))
    return Readings(time, count[seen], np.append(0.0, steps.time)[seen])


def clocks(seconds: FloatArray, clock_s: float, period_s: float | None = None) -> IntArray:
    """Return what a clock of `clock_s` (s) shows at some times; a time within rounding of a clock edge is at the edge.

    It raises ValueError if the clock is not shorter than the control period, if there is one.
    """
    if not 0 < clock_s < (period_s or math.inf):
        raise ValueError(f"clock must be more than 0 s and shorter than the control period, not {short_time(clock_s)}")
    return np.floor(seconds / clock_s + 1e-6).astype(np.int64)


def _held(value: FloatArray, known: NDArray[np.bool_]) -> FloatArray:
    """Return each value that is known, and in place of each other one the latest that is, or 0."""
    latest = np.maximum.accumulate(np.where(known, np.arange(1, len(value) + 1), 0))
    return np.append(0.0, value)[latest]


def low_pass(value: ArrayLike, period_s: float, filter_s: float) -> FloatArray:
    """Return first-order low-pass filter y = a y + (1 - a) x with a = filter_s / (filter_s + period_s), from y = 0."""
    if filter_s < 0:
        raise ValueError(f"time constant of the filter must be at least 0 s, not {short_time(filter_s)}")
    a = filter_s / (filter_s + period_s)
    added = (1 - a) * np.asarray(value, dtype=np.float64)
    return np.array(list(accumulate(added.tolist(), lambda y, x: a * y + x)), dtype=np.float64)


def finite_difference(steps: Steps, period_s: float, filter_s: float = 5e-3) -> Estimate:
    """Return counts of each period over the period, then a low-pass filter.

    - `filter_s`, seconds: Time constant of the filter; 0 for none. SimpleFOC's default is 5 ms.
    """
    readings = read(steps, period_s)
    raw = readings.difference * steps.count_rad / period_s
    return Estimate(readings.time, low_pass(raw, period_s, filter_s))


def timestamp_method(steps: Steps, period_s: float, timeout_s: float = 0.5, clock_s: float = 0.5e-6) -> Estimate:
    """Return LinuxCNC's hostmot2: counts over the time between the latest counts, as two readings find them.

    Without a new count the speed is bounded by one count since the latest, and is 0 from `timeout_s` on. After that,
    and at the start, the first reading with a new count gives only a time to measure from. One count back, after a
    measurement forward or the other way round, is taken for a shaft that rests on an edge: speed 0.

    - `period_s`, seconds: LinuxCNC's servo period is usually 1 ms.
    - `timeout_s`, seconds: `vel-timeout`, 0.5 s by default.
    - `clock_s`, seconds: Unit of the timestamps: about 0.5 us by default, 0.1 us with `hires-timestamp`.
    """
    readings = read(steps, period_s)
    now = clocks(readings.time, clock_s, period_s)
    new = readings.difference != 0
    event = np.flatnonzero(new)
    if not len(event):
        return Estimate(readings.time, np.zeros(len(now)))
    stamp = clocks(readings.changed_at[event], clock_s, period_s)
    moved = readings.difference[event]
    waited = (now[event[1:] - 1] - stamp[:-1]) * clock_s
    start = np.append(True, (np.diff(event) > 1) & (waited >= timeout_s))
    moved_before = np.append(0, np.where(start, 0, moved)[:-1])
    zero = start | ((np.abs(moved) == 1) & (moved * moved_before < 0))
    elapsed = np.diff(stamp, prepend=stamp[0])
    measured = ~zero & (elapsed > 0)
    measurement = np.divide(moved, elapsed * clock_s, out=np.zeros(len(event)), where=measured)
    measurement = _held(measurement, zero | measured)

    latest = np.cumsum(new) - 1  # event of each reading, -1 before the first
    speed = np.where(latest < 0, 0.0, measurement[latest])
    age = np.where(new, 0.0, (now - stamp[latest]) * clock_s)
    bound = np.divide(1.0, age, out=np.full(len(now), np.inf), where=age > 0)
    speed = np.where(age >= timeout_s, 0.0, np.copysign(np.minimum(np.abs(speed), bound), speed))
    return Estimate(readings.time, speed * steps.count_rad)


def mixed_method(steps: Steps, period_s: float, timeout_s: float = 0.1, clock_s: float = 1e-6) -> Estimate:
    """Return SimpleFOC's encoder: dN / (Ts + Th of the reading before - Th), held while there is no new count.

    dN are the counts of the period Ts, Th is the age of the latest count at a reading. A measurement over less than
    half a period is left out, and the speed is 0 once Th is more than `timeout_s`. SimpleFOC controls with what
    `low_pass` makes of this, with a time constant of 5 ms by default.

    - `timeout_s`, seconds: 0.1 s in SimpleFOC.
    - `clock_s`, seconds: Unit of the times of counts: 1 us in SimpleFOC.
    """
    readings = read(steps, period_s)
    now = clocks(readings.time, clock_s, period_s)
    age = now - clocks(readings.changed_at, clock_s, period_s)
    elapsed = np.diff(now, prepend=0) + np.append(0, age[:-1]) - age
    measured = (readings.difference != 0) & (2 * elapsed > np.diff(now, prepend=0))
    speed = np.divide(readings.difference, elapsed * clock_s, out=np.zeros(len(now)), where=measured)
    timed_out = age * clock_s > timeout_s
    speed = _held(np.where(timed_out, 0.0, speed), measured | timed_out)
    return Estimate(readings.time, speed * steps.count_rad)


def tracking_loop(
    steps: Steps, period_s: float, bandwidth_rad_s: float = 1000.0, whole_counts: bool = True
) -> Estimate:
    """Return a critically damped second-order loop that follows the count: kp = 2 bandwidth, ki = kp^2 / 4.

    At constant acceleration it shows the speed of 2 / bandwidth - period / 2 ago. moteus also limits the speed to an
    eighth of a revolution per period, which is left out.

    - `period_s`, seconds: 125 us in ODrive, 33 us in moteus.
    - `bandwidth_rad_s`, rad/s: Natural frequency: ODrive's `bandwidth`, 1000 by default, and 2 pi / `MOTEUS_3DB_RATIO`
      times moteus's `pll_filter_hz`, 400 by default.
    - `whole_counts`: As ODrive: the error is the count less the whole counts of the loop's position, and a speed below
      half of what an error of one count adds in a period is set to 0. Otherwise as moteus: the error has its fraction.

    It raises ValueError if kp times the period is 1 or more: ODrive refuses such a loop as unstable.
    """
    kp, ki = 2 * bandwidth_rad_s, bandwidth_rad_s**2
    if not 0 < kp * period_s < 1:
        raise ValueError(f"twice the bandwidth times the control period must be less than 1, not {kp * period_s:.6g}")
    readings = read(steps, period_s)
    least = 0.5 * period_s * ki if whole_counts else 0.0
    position = speed = 0.0  # counts, counts/s
    to_position, to_speed, floor = period_s * kp, period_s * ki, math.floor
    speeds = []
    for count in readings.counts.tolist():
        position += period_s * speed
        error = count - (floor(position) if whole_counts else position)
        position += to_position * error
        speed += to_speed * error
        if -least < speed < least:
            speed = 0.0
        speeds.append(speed)
    return Estimate(readings.time, np.array(speeds) * steps.count_rad)


def delay_seconds(time: FloatArray, velocity: FloatArray, true_speed: FloatArray, max_delay_s: float = 0.02) -> float:
    """Delay of a measured speed: the shift of the true one that comes closest to it in the mean square.

    Between samples by a parabola. The first and last `max_delay_s` of the measurement are left out.

    - `time`, shape (n,), seconds, evenly spaced, more than 2 `max_delay_s` long
    - `velocity`, `true_speed`, shape (n,), the same unit: At these times; the true speed must not look alike twice
      within `max_delay_s`.
    - `max_delay_s`, seconds: Largest delay that is looked for, either way.

    It raises ValueError if the times are not so, or no shift within `max_delay_s` is closer than those beside it.
    """
    even = len(time) > 1 and np.allclose(np.diff(time), time[1] - time[0], rtol=1e-6, atol=0)
    period = (time[-1] - time[0]) / (len(time) - 1) if even else math.inf
    reach = math.ceil(max_delay_s / period)
    n_compared = len(time) - 2 * reach
    if not even or n_compared < 1:
        raise ValueError(f"times must be evenly spaced and more than {2 * max_delay_s} s long")
    mean = np.mean(true_speed)
    truth, measured = true_speed - mean, velocity[reach : reach + n_compared] - mean
    # The shift of row i is reach - i samples.
    product = np.fft.irfft(np.fft.rfft(truth) * np.conj(np.fft.rfft(measured, len(truth))), len(truth))
    energy = np.append(0.0, np.cumsum(truth**2))
    distance = energy[n_compared:] - energy[:-n_compared] - 2 * product[: 2 * reach + 1]
    best = int(np.argmin(distance))
    before, least, after = distance[best - 1 : best + 2] if 0 < best < 2 * reach else (0.0, 0.0, 0.0)
    curvature = before - 2 * least + after
    if not curvature > 0:
        raise ValueError(f"no delay within {max_delay_s} s stands out")
    return float(period * (reach - best - 0.5 * (before - after) / curvature))
