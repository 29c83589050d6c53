"""Filters that others use on the positions of an absolute encoder, one a tick, are modelled in floats.

Each filter starts at the first position, at rest, and shows the speed at the instant of reading: what has an
acceleration carries the speed on over the age of the position.
"""

import numpy as np

from tachometry.sim.studies.comparing.baselines import Estimate, Steps, read, tracking_loop
from tachometry.sim.studies.comparing.estimators import filtered, kalman_gains

_MOST_READS, _MOST_ORDER = 10_000, 5


def alpha_beta(steps: Steps, index: float = 0.01, order: int = 2) -> Estimate:
    """Return an alpha-beta filter, or with order 3 an alpha-beta-gamma filter; gains are those of `kalman_gains`.

    - `index`: Tracking index, as of `kalman_gains`.
    """
    return filtered(steps, read(steps, None), steps.tick_s, kalman_gains(index, order))


def phase_locked_loop(steps: Steps, bandwidth_rad_s: float = 1000.0) -> Estimate:
    """Return `tracking_loop` with the fraction of the position, an iteration for each."""
    return tracking_loop(steps, steps.tick_s, bandwidth_rad_s, whole_counts=False)


def savitzky_golay(steps: Steps, reads: int = 9, order: int = 2) -> Estimate:
    """Return the slope of a polynomial through the latest positions by least squares.

    Savitzky, Golay: Smoothing and differentiation of data by simplified least squares procedures, Analytical Chemistry
    36(8), 1964. It raises ValueError if a parameter is out of range.

    - `reads`, more than `order`, at most 10,000: Number of positions.
    - `order`, from 1 to 5: Of the polynomial.
    """
    if not 1 <= order <= _MOST_ORDER:
        raise ValueError(f"order of the polynomial must be from 1 to {_MOST_ORDER}, not {order}")
    if not order < reads <= _MOST_READS:
        raise ValueError(f"number of reads must be more than the order, {order}, and at most {_MOST_READS}")
    readings, now = read(steps, None), steps.age_s / steps.tick_s
    powers = (np.arange(reads) / reads)[:, None] ** np.arange(order + 1)  # of the time back from the latest
    slope = np.arange(order + 1) * (-now / reads) ** np.maximum(np.arange(order + 1) - 1, 0) / -reads
    weights = slope @ np.linalg.pinv(powers)
    first = np.full(reads - 1, readings.counts[0] if len(readings.counts) else 0)
    speed = np.convolve(np.append(first, readings.counts), weights, "valid")
    return Estimate(readings.time, speed / steps.tick_s * steps.count_rad)
