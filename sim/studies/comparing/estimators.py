"""Three estimators of textbooks are modelled in floats, each from its paper.

A polynomial through the latest edges by least squares, a window as long as a straight line allows, and a Kalman filter
in its steady state. They read the encoder as those of `baselines` do, at period, 2 periods, ..., and are at rest at
time 0, at count 0.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.comparing.baselines import Estimate, IntArray, Readings, Steps, clocks, read

QUANTISATION = 1 / math.sqrt(12)
"""Standard deviation of what is lost when a position is counted, in counts."""

_MOST_EDGES = _LONGEST = 10_000  # edges of a polynomial, and periods of a window
_MOST_ORDER = 5  # beyond that, digits are lost
_LEAST_INDEX, _GREATEST_INDEX = 1e-15, 1e6
_BACK, _AT_ONCE = 64, 1 << 15  # edges of each polynomial, and of all, that are summed at once
_SHARED_ORDER = 3  # sums up to it serve all lower ones
_READINGS = 1 << 14  # whose windows grow at once: they stay in the cache of a processor
_RIDGE = 1e-12  # of the normal equations: edges with one timestamp do not make them singular


@dataclass(frozen=True, eq=False)
class Edges:
    """Time-stamped edges, and the readings of a method that uses them."""

    count_rad: float
    time: FloatArray  # shape (n,), seconds: of each reading
    latest: IntArray  # shape (n,): the latest edge of each reading, -1 before the first
    silence: FloatArray  # shape (n,), seconds since that edge
    stamp: FloatArray  # shape (m,), seconds: of each edge
    place: FloatArray  # shape (m,), counts: half a count before the new count, as a reversal meets the same edge

    @staticmethod
    @functools.lru_cache(maxsize=2)  # for all settings of a method
    def of(steps: Steps, period_s: float | None) -> "Edges":
        """Return the edges of an encoder; without a period (s), each read of a loop is a reading."""
        readings, unit = read(steps, period_s), steps.clock_s
        latest = np.searchsorted(steps.time, readings.time, side="right") - 1
        stamp = (clocks(steps.time, unit, period_s) * unit).astype(np.float64)
        silence = clocks(readings.time, unit, period_s) * unit - np.append(stamp, -np.inf)[latest]
        place = (np.cumsum(steps.step) - steps.step / 2).astype(np.float64)
        return Edges(steps.count_rad, readings.time, latest, silence, stamp, place)

    def estimate(self, slope: FloatArray, bound: float, timeout_s: float) -> Estimate:
        """Return the speed of slopes (counts/s): at most `bound` counts in the silence, and 0 after the timeout."""
        if not bound > 0:
            raise ValueError(f"bound must be more than 0 counts, not {bound:g}")
        most = np.divide(bound, self.silence, out=np.full(len(slope), np.inf), where=self.silence > 0)
        speed = np.where(self.silence > timeout_s, 0.0, np.clip(slope, -most, most))
        return Estimate(self.time, speed * self.count_rad)


def least_squares(
    steps: Steps, period_s: float | None, edges: int = 16, order: int = 2, timeout_s: float = 0.1, bound: float = 2.0
) -> Estimate:
    """Return a polynomial of time through the latest edges by least squares; its slope at the reading is the speed.

    Brown, Schneider, Mulligan: Analysis of algorithms for velocity estimation from discrete position versus time data,
    IEEE Trans. Industrial Electronics 39(1), 1992; Merry, van de Molengraft, Steinbuch: Velocity and acceleration
    estimation for optical incremental encoders, Mechatronics 20(1), 2010. With fewer edges the order is at most one
    less than their number. Two things are added, without which the polynomial runs on after a stop: a silence bounds
    the speed to `bound` counts in that time, and after `timeout_s` the speed is 0 and the next edge begins anew.

    - `period_s`, seconds: Control period; None: each read of a loop is a reading.
    - `edges`, more than `order`, at most 10,000: Number of edges that the polynomial is fitted to.
    - `order`, from 1 to 5: Of the polynomial: 1 for a straight line, which lags by half of its length, 2 with
      acceleration.
    - `bound`, counts: Distance that the shaft may go without an edge: the slots of a bad disc are uneven.

    It raises ValueError if a parameter is out of range.
    """
    if not 1 <= order <= _MOST_ORDER:
        raise ValueError(f"order of the polynomial must be from 1 to {_MOST_ORDER}, not {order}")
    if not order < edges <= _MOST_EDGES:
        raise ValueError(
            f"number of edges must be more than the order, {order}, and at most {_MOST_EDGES}, not {edges}"
        )
    seen = Edges.of(steps, period_s)
    return seen.estimate(_windows(seen, timeout_s, max(order, _SHARED_ORDER)).slopes(edges, order), bound, timeout_s)


class _Windows:
    """Sums over the latest edges of each fit, which grow from one number of edges to the next.

    A fit is needed for each edge that is the latest of a reading. Time 0 is that edge.
    """

    def __init__(self, seen: Edges, timeout_s: float, order: int) -> None:
        self._seen, self._moved = seen, np.flatnonzero(seen.latest >= 0)
        self._last, self._which = np.unique(seen.latest[self._moved], return_inverse=True)
        begins = np.where(np.diff(seen.stamp, prepend=seen.stamp[:1]) > timeout_s, np.arange(len(seen.stamp)), 0)
        self._most = self._last - np.maximum.accumulate(begins)[self._last] + 1
        self._n, self._powers = 0, np.zeros((len(self._last), 2 * order + 1))  # sums of time^k
        self._known = np.zeros((len(self._last), order + 1))  # of place times time^k

    def _grow(self, edges: int) -> None:
        if edges < self._n:
            self._n, self._powers[:], self._known[:] = 0, 0, 0
        end = min(edges, int(np.max(self._most, initial=0)))
        for begin in range(self._n, end, _BACK):
            back = np.arange(begin, min(begin + _BACK, end))
            for part in np.array_split(np.arange(len(self._last)), 1 + len(self._last) * len(back) // _AT_ONCE):
                last = self._last[part, np.newaxis]
                place = np.maximum(last - back, 0)
                power = (back < self._most[part, np.newaxis]).astype(np.float64)
                time = (self._seen.stamp[place] - self._seen.stamp[last]) * power
                moved = self._seen.place[place] - self._seen.place[last]
                for k in range(self._powers.shape[1]):
                    self._powers[part, k] += np.sum(power, axis=1)
                    if k < self._known.shape[1]:
                        self._known[part, k] += np.einsum("ei,ei->e", power, moved)
                    power *= time
        self._n = edges

    def slopes(self, edges: int, order: int) -> FloatArray:
        """Return the slope of the polynomial at each reading, counts/s; 0 where there is none."""
        self._grow(edges)
        n_used, stamp = np.minimum(edges, self._most), self._seen.stamp
        span = stamp[self._last] - stamp[self._last - n_used + 1]
        span[span == 0] = np.inf  # edges at one instant have no slope
        coefficient, slope = np.zeros((len(span), order)), np.zeros(len(self._seen.time))
        for degree in range(1, order + 1):
            fitted = np.flatnonzero(np.minimum(order, n_used - 1) == degree)
            row, scale = np.arange(degree + 1), span[fitted, np.newaxis] ** -np.arange(2 * degree + 1.0)
            matrix = (self._powers[fitted, : 2 * degree + 1] * scale)[:, row[:, np.newaxis] + row]
            known = self._known[fitted, : degree + 1] * scale[:, : degree + 1]
            of = np.linalg.solve(matrix + _RIDGE * np.eye(degree + 1), known[:, :, np.newaxis])
            coefficient[fitted, :degree] = of[:, 1:, 0]
        powers, span = np.arange(order), span[self._which]
        ahead = (self._seen.silence[self._moved] / span)[:, np.newaxis] ** powers
        slope[self._moved] = np.sum(coefficient[self._which] * (powers + 1) * ahead, axis=1) / span
        return slope


_windows = functools.lru_cache(maxsize=1)(_Windows)  # for all settings on the same edges


def adaptive_window(
    steps: Steps, period_s: float, noise_bound: float = 1.0, longest: int = 100, best_fit: bool = True
) -> Estimate:
    """Return first-order adaptive windowing (FOAW): the slope over the longest window in which a straight line holds.

    Janabi-Sharifi, Hayward, Chen: Discrete-time adaptive windowing for velocity estimation, IEEE Trans. Control Systems
    Technology 8(6), 2000. The window grows back from the latest reading, one period at a time, while a line through
    that reading passes all others in the window within the noise bound. The slope of the line is that between the ends
    of the window (end-fit), or that of the least squares (best-fit).

    - `noise_bound`, counts, at least 0: The paper's d: greatest distance of a reading from the line. Counting alone
      needs 1.
    - `longest`, periods, from 1 to 10,000: No window is longer.
    - `best_fit`: The slope of the least squares in place of that between the ends.

    It raises ValueError if a parameter is out of range.
    """
    if not noise_bound >= 0:
        raise ValueError(f"noise bound must be at least 0 counts, not {noise_bound}")
    if not 1 <= longest <= _LONGEST:
        raise ValueError(f"longest window must be from 1 to {_LONGEST} periods, not {longest}")
    readings = read(steps, period_s)
    count = np.append(0, readings.counts).astype(np.float64)
    slope = np.zeros(len(count))
    every: IntArray = np.arange(1, len(count))
    for part in np.array_split(every, 1 + len(every) // _READINGS):
        _grow(slope, count, part, noise_bound, longest, best_fit)
    return Estimate(readings.time, slope[1:] / period_s * steps.count_rad)


def _grow(
    slope: FloatArray, count: FloatArray, grows: IntArray, noise_bound: float, longest: int, best_fit: bool
) -> None:
    """Put the slopes of some readings, whose windows still grow, into their places."""
    # Of each: the least and the greatest slope that all readings so far allow, and two sums for the least squares.
    state: FloatArray = np.zeros((4, len(grows)))
    state[0], state[1] = -np.inf, np.inf
    for length in range(1, longest + 1):
        if len(grows) and grows[0] < length:  # no window begins before time 0
            grows, state = grows[1:], state[:, 1:]
        if not len(grows):
            break
        moved = count[grows] - count[grows - length]
        state[0] = np.maximum(state[0], (moved - noise_bound) / length)
        state[1] = np.minimum(state[1], (moved + noise_bound) / length)
        state[2] += moved
        state[3] += length * moved
        found = moved / length
        if best_fit:
            found = 6 * (2 * state[3] - length * state[2]) / (length * (length + 1) * (length + 2))
        holds = (state[0] <= found) & (found <= state[1])
        slope[grows[holds]] = found[holds]
        if not holds.all():
            grows, state = grows[holds], state[:, holds]


def kalman_gains(index: float, order: int) -> tuple[float, float, float]:
    """Return gains of position, speed and acceleration of the Kalman filter in its steady state, per period.

    They are those of the alpha-beta and the alpha-beta-gamma filter: Kalata, The tracking index, IEEE Trans. Aerospace
    and Electronic Systems 20(2), 1984; the equation of order 3 is that of Gray and Murray, same journal 29(3), 1993,
    with u = 1 - s, which does not lose digits where the index is small.

    - `index`, from 1e-15 to 1e6: Tracking index: standard deviation of the acceleration's change in a period (order 3),
      or of the acceleration (order 2), times the period squared, over that of the measured position.
    - `order`, 2 or 3: Without or with acceleration; its gain is 0 with order 2.

    It raises ValueError if a parameter is out of range.
    """
    if order not in (2, 3):
        raise ValueError(f"order of the filter must be 2 or 3, not {order}")
    if not _LEAST_INDEX <= index <= _GREATEST_INDEX:
        raise ValueError(f"tracking index must be from {_LEAST_INDEX:g} to {_GREATEST_INDEX:g}, not {index:g}")
    if order == 2:
        u = 2 * index / (math.sqrt(index * index + 8 * index) + index)
    else:
        roots = np.roots([1, -index / 2, 1.5 * index, -index])
        u = float(roots[np.argmin(np.abs(roots.imag))].real)
    alpha, beta = u * (2 - u), 2 * u * u
    return alpha, beta, beta * beta / (2 * alpha) if order == 3 else 0.0


def kalman(steps: Steps, period_s: float, process_noise: float = 300.0, order: int = 2) -> Estimate:
    """Return a Kalman filter in its steady state; what is measured is the count, with the noise of counting,
    1/sqrt(12).

    The acceleration is constant within each period. With order 2 it is random in each; its standard deviation a gives a
    bandwidth of about sqrt(a sqrt(12) / count in rad), rad/s. With order 3 it changes at random from each to the next,
    by its derivative j times the period; the bandwidth is about the cube root of (j sqrt(12) / count in rad).

    - `process_noise`, more than 0, rad/s^2 with order 2, rad/s^3 with order 3: Standard deviation of the acceleration,
      or of its derivative; the tracking index that follows from it must be as for `kalman_gains`.
    - `order`, 2 or 3: States: position and speed, and acceleration with order 3.

    It raises ValueError if a parameter is out of range.
    """
    readings = read(steps, period_s)
    index = process_noise * period_s ** min(order, 3) / (steps.count_rad * QUANTISATION)
    return filtered(steps, readings, period_s, kalman_gains(index, order))


def filtered(steps: Steps, readings: Readings, period_s: float, gains: tuple[float, float, float]) -> Estimate:
    """Return the speed of a filter with constant gains of position, speed and acceleration, at each reading."""
    (alpha, beta, gamma), ahead = gains, steps.age_s / period_s
    position = speed = acceleration = 0.0  # counts, per period, per period squared
    speeds = []
    for count in readings.counts.tolist():
        position += speed + acceleration / 2
        speed += acceleration
        error = count - position
        position += alpha * error
        speed += beta * error
        acceleration += gamma * error
        speeds.append(speed + acceleration * ahead)
    return Estimate(readings.time, np.array(speeds) / period_s * steps.count_rad)
