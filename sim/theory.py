"""The papers' equations, one function each, vectorised over numpy arrays.

Both papers number their equations from (1); names say which is meant.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def unit_velocity(counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """ω_u = 2π/(P·T_s) in rad/s: one count per sampling period (Tsuji 2009, Sec. V-A)."""
    return 2 * math.pi / (np.asarray(counts_per_rev, dtype=float) * np.asarray(tick_seconds, dtype=float))


def tsuji_eq17_velocity(
    pulse_sum: ArrayLike, m_s: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike
) -> Floats:
    """Eq. (17) of Tsuji 2009: velocity of the S method in rad/s.

    Parameters
    ----------
    pulse_sum : counts, Σ_{j=0}^{m_s−1} m_e(i−j)
    m_s : ticks
    counts_per_rev : P
    tick_seconds : T_s in seconds
    """
    return np.asarray(pulse_sum) / np.asarray(m_s) * unit_velocity(counts_per_rev, tick_seconds)


def tsuji_eq18_resolution(m_s: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Eq. (18) of Tsuji 2009: resolution Q_V = ω_u/(m_s·(m_s − 1)) of the S method in rad/s.

    Infinite for m_s = 1. For any real m_s ≥ 1, as eq. (20) gives it.
    """
    m_s = np.asarray(m_s, dtype=float)
    with np.errstate(divide="ignore"):
        return unit_velocity(counts_per_rev, tick_seconds) / (m_s * (m_s - 1))


def tsuji_eq19_measurement_time(m_s: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Eq. (19) of Tsuji 2009: measurement time T_m = m_s·T_s in seconds."""
    return np.asarray(m_s, dtype=float) * np.asarray(tick_seconds, dtype=float)


def tsuji_eq20_interval(speed: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Eq. (20) of Tsuji 2009: mean m_s = 1/|ω/ω_u − ⌊ω/ω_u + ½⌋| in ticks; infinite at multiples of ω_u.

    Parameters
    ----------
    speed : ω in rad/s
    counts_per_rev : P
    tick_seconds : T_s in seconds
    """
    units = np.asarray(speed, dtype=float) / unit_velocity(counts_per_rev, tick_seconds)
    with np.errstate(divide="ignore"):
        return 1 / np.abs(units - np.floor(units + 0.5))
