"""Three estimators of textbooks are modelled in floats, each from its paper.

A polynomial through the latest edges by least squares, a window as long as a straight line allows, and a Kalman filter
in its steady state. They read the encoder as those of `baselines` do, at period, 2 periods, ..., and are at rest at
time 0, at count 0.
"""

import math

import numpy as np

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.studies.comparing.baselines import Estimate, IntArray, Steps, clocks, read

QUANTISATION = 1 / math.sqrt(12)
"""Standard deviation of what is lost when a position is counted, in counts."""

_MOST_EDGES = _LONGEST = 10_000  # edges of a polynomial, and periods of a window
_MOST_ORDER = 5  # beyond that, digits are lost
_LEAST_INDEX, _GREATEST_INDEX = 1e-15, 1e6
_MOST_SILENT = 2  # counts that the shaft may go without one: the slots of a bad disc are that uneven
_AT_ONCE = 1 << 20  # edges of polynomials, for which memory is needed at once
_READINGS = 1 << 14  # whose windows grow at once: they stay in the cache of a processor
_RIDGE = 1e-12  # of the normal equations: edges with one timestamp do not make them singular


def least_squares(
    steps: Steps, period_s: float, edges: int = 16, order: int = 2, timeout_s: float = 0.1, clock_s: float = 1e-7
) -> Estimate:
    """Return a polynomial of time through the latest edges by least squares; its slope at the reading is the speed.

    Brown, Schneider, Mulligan: Analysis of algorithms for velocity estimation from discrete position versus time data,
    IEEE Trans. Industrial Electronics 39(1), 1992; Merry, van de Molengraft, Steinbuch: Velocity and acceleration
    estimation for optical incremental encoders, Mechatronics 20(1), 2010. The position of an edge is half a count
    before the count it makes: a reversal meets the same edge again. With fewer edges the order is at most one less than
    their number. Two things are added here, without which the polynomial runs on after a stop: a silence bounds the
    speed to 2 counts in that time, and after `timeout_s` the speed is 0 and the next edge begins anew.

    Parameters
    ----------
    period_s : float, seconds
    edges : int, more than `order`, at most 10,000
        Number of edges that the polynomial is fitted to.
    order : int, from 1 to 5
        Of the polynomial: 1 for a straight line, which lags by half of its length, 2 with acceleration.
    timeout_s : float, seconds
    clock_s : float, seconds
        Unit of the timestamps.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """
    if not 1 <= order <= _MOST_ORDER:
        raise ValueError(f"order of the polynomial must be from 1 to {_MOST_ORDER}, not {order}")
    if not order < edges <= _MOST_EDGES:
        raise ValueError(
            f"number of edges must be more than the order, {order}, and at most {_MOST_EDGES}, not {edges}"
        )
    readings = read(steps, period_s)
    now = clocks(readings.time, clock_s, period_s) * clock_s
    speed = np.zeros(len(now))
    latest = np.searchsorted(steps.time, readings.time, side="right") - 1
    moved = np.flatnonzero(latest >= 0)
    if not len(moved):
        return Estimate(readings.time, speed)
    stamp = (clocks(steps.time, clock_s, period_s) * clock_s).astype(np.float64)
    position = (np.cumsum(steps.step) - steps.step / 2).astype(np.float64)
    place = np.arange(len(stamp))
    anew = np.maximum.accumulate(np.where(np.diff(stamp, prepend=stamp[0]) > timeout_s, place, 0))
    # A fit is needed for each edge that is the latest of a reading.
    last, which = np.unique(latest[moved], return_inverse=True)
    n_used = np.minimum(edges, last - anew[last] + 1)
    silence = now[moved] - stamp[latest[moved]]
    slope = np.zeros(len(moved))
    for degree in range(1, order + 1):
        fitted = np.minimum(order, n_used - 1) == degree
        if not np.any(fitted):
            continue
        row = (np.cumsum(fitted) - 1)[which]
        coefficient, span = _fit(stamp, position, last[fitted], n_used[fitted], degree)
        mine = np.flatnonzero(fitted[which])
        powers = np.arange(degree)
        ahead = (silence[mine] / span[row[mine]])[:, np.newaxis] ** powers
        slope[mine] = np.sum(coefficient[row[mine], 1:] * (powers + 1) * ahead, axis=1) / span[row[mine]]
    bound = np.divide(_MOST_SILENT, silence, out=np.full(len(moved), np.inf), where=silence > 0)
    slope = np.clip(slope, -bound, bound)
    speed[moved] = np.where(silence > timeout_s, 0.0, slope)
    return Estimate(readings.time, speed * steps.count_rad)


def _fit(
    stamp: FloatArray, position: FloatArray, last: IntArray, n_used: IntArray, degree: int
) -> tuple[FloatArray, FloatArray]:
    """Return polynomials through the edges up to each of `last`, and the unit of time (s) of each, which is what they
    span.

    Time 0 is the latest edge, and the coefficient of the k-th power is in column k.
    """
    span = stamp[last] - stamp[last - n_used + 1]
    span[span == 0] = np.inf  # of edges at one instant nothing is told
    back = np.arange(int(np.max(n_used)))
    moment = np.empty((len(last), 2 * degree + 1))  # sums of time^k, and of position times time^k
    known = np.empty((len(last), degree + 1))
    for part in np.array_split(np.arange(len(last)), 1 + len(last) * len(back) // _AT_ONCE):
        place = np.maximum(last[part, np.newaxis] - back, 0)
        time = (stamp[place] - stamp[last[part], np.newaxis]) / span[part, np.newaxis]
        moved = position[place] - position[last[part], np.newaxis]
        power = (back < n_used[part, np.newaxis]).astype(np.float64)
        time *= power
        for k in range(2 * degree + 1):
            moment[part, k] = np.sum(power, axis=1)
            if k <= degree:
                known[part, k] = np.einsum("ei,ei->e", power, moved)
            power *= time
    row = np.arange(degree + 1)
    matrix = moment[:, row[:, np.newaxis] + row] + _RIDGE * np.eye(degree + 1)
    return np.linalg.solve(matrix, known[:, :, np.newaxis])[:, :, 0].astype(np.float64), span


def adaptive_window(
    steps: Steps, period_s: float, noise_bound: float = 1.0, longest: int = 100, best_fit: bool = True
) -> Estimate:
    """Return first-order adaptive windowing (FOAW): the slope over the longest window in which a straight line holds.

    Janabi-Sharifi, Hayward, Chen: Discrete-time adaptive windowing for velocity estimation, IEEE Trans. Control Systems
    Technology 8(6), 2000. The window grows back from the latest reading, one period at a time, while a line through
    that reading passes all others in the window within the noise bound. The slope of the line is that between the ends
    of the window (end-fit), or that of the least squares (best-fit).

    Parameters
    ----------
    period_s : float, seconds
    noise_bound : float, counts, at least 0
        The paper's d: greatest distance of a reading from the line. Counting alone needs 1.
    longest : int, periods, from 1 to 10,000
        No window is longer.
    best_fit : bool
        The slope of the least squares in place of that between the ends.

    Raises
    ------
    ValueError
        If a parameter is out of range.
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

    Parameters
    ----------
    index : float, from 1e-15 to 1e6
        Tracking index: standard deviation of the acceleration's change in a period (order 3), or of the acceleration
        (order 2), times the period squared, over that of the measured position.
    order : int, 2 or 3
        Without or with acceleration; its gain is 0 with order 2.

    Raises
    ------
    ValueError
        If a parameter is out of range.
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

    Parameters
    ----------
    period_s : float, seconds
    process_noise : float, more than 0, rad/s^2 with order 2, rad/s^3 with order 3
        Standard deviation of the acceleration, or of its derivative; the tracking index that follows from it must be
        as for `kalman_gains`.
    order : int, 2 or 3
        States: position and speed, and acceleration with order 3.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """
    readings = read(steps, period_s)
    index = process_noise * period_s ** min(order, 3) / (steps.count_rad * QUANTISATION)
    alpha, beta, gamma = kalman_gains(index, order)
    position = speed = acceleration = 0.0  # counts, per period, per period squared
    speeds = []
    for count in readings.counts.tolist():
        position += speed + acceleration / 2
        speed += acceleration
        error = count - position
        position += alpha * error
        speed += beta * error
        acceleration += gamma * error
        speeds.append(speed)
    return Estimate(readings.time, np.array(speeds) / period_s * steps.count_rad)
