"""Equations (7) to (20) of Tsuji 2009: resolution and measurement time of the M, T, M/T and S methods.

Every function is vectorised: arguments are broadcast against each other, and the result has their shape, float64.
Throughout, `counts_per_rev` is P and `tick_seconds` is T_s in seconds, both greater than 0; velocities and resolutions
are in rad/s, measurement times in seconds, m_s, n and m_c = T_c/T_s in ticks, at least 1, whole or mean. A `speed` is ω
in rad/s, of either sign. A `pulse_sum` is Σ m_e(i−j) over j from 0 to m_s − 1 in counts: with the closing tick of the
window, without the opening one. What is out of range raises ValueError.
"""

import math

import numpy as np
from numpy.typing import ArrayLike

from tachometry.sim.theory.checks import Floats, at_least, positive


def unit_velocity(counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Return ω_u = 2π/(P·T_s) in rad/s: one count per sampling period (Tsuji 2009, Sec. V-A)."""
    return 2 * math.pi / (positive("counts_per_rev", counts_per_rev) * positive("tick_seconds", tick_seconds))


def _interval_resolution(m_s: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    m_s = at_least("m_s", m_s, 1)
    with np.errstate(divide="ignore"):
        return unit_velocity(counts_per_rev, tick_seconds) / (m_s * (m_s - 1))


def _duration(what: str, ticks: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    return at_least(what, ticks, 1) * positive("tick_seconds", tick_seconds)


def tsuji_eq07_resolution(n: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (7) of Tsuji 2009: resolution ω_u/n of the M method with averaging, the supremum of errors."""
    return unit_velocity(counts_per_rev, tick_seconds) / at_least("n", n, 1)


def tsuji_eq08_measurement_time(n: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (8) of Tsuji 2009: measurement time T_m = n·T_s of the M method with averaging."""
    return _duration("n", n, tick_seconds)


def tsuji_eq10_resolution(m_s: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (10) of Tsuji 2009: resolution Q_V = ω_u/(m_s·(m_s − 1)) of the T method; infinite for m_s = 1.

    It is the step from the velocity of m_s ticks to that of m_s − 1, and the supremum of the errors.
    """
    return _interval_resolution(m_s, counts_per_rev, tick_seconds)


def tsuji_eq11_measurement_time(m_s: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (11) of Tsuji 2009: measurement time T_m = m_s·T_s of the T method."""
    return _duration("m_s", m_s, tick_seconds)


def tsuji_eq12_interval(speed: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (12) of Tsuji 2009: mean m_s = ω_u/|ω| of the T method in ticks; infinite at standstill.

    A single m_s is one of the two integers beside it. Above ω_u it is less than 1, and the method fails. The printed
    form is for ω > 0.
    """
    with np.errstate(divide="ignore"):
        return unit_velocity(counts_per_rev, tick_seconds) / np.abs(np.asarray(speed, dtype=np.float64))


def tsuji_eq14_resolution(
    pulse_sum: ArrayLike, m_s: ArrayLike, m_c: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike
) -> Floats:
    """Compute eq. (14) of Tsuji 2009: resolution Q_V = min(|Σ m_e|·ω_u/(m_s·(m_s − 1)), ω_u/m_c) of the M/T method.

    Errors are less. The first term is the supremum for the time, uncertain by less than a tick at either end; the
    second is that for the counts when m_s = m_c, and more than it in longer windows.
    """
    counts = at_least("|pulse_sum|", np.abs(pulse_sum), 1)
    by_time = counts * _interval_resolution(m_s, counts_per_rev, tick_seconds)
    by_count = unit_velocity(counts_per_rev, tick_seconds) / at_least("m_c", m_c, 1)
    return np.minimum(by_time, by_count)


def tsuji_eq15_measurement_time(m_s: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (15) of Tsuji 2009: measurement time T_m = m_s·T_s of the M/T method."""
    return _duration("m_s", m_s, tick_seconds)


def tsuji_eq16_interval(speed: ArrayLike, m_c: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (16) of Tsuji 2009: mean m_s = m_c·(⌊x⌋ + 1)/x of the M/T method in ticks, x = |ω|/ω_u·m_c.

    x counts come in T_c; the window ends with the first one later than that. The printed form lacks the factor m_c: it
    is the time in units of T_c. Infinite at standstill.
    """
    m_c = at_least("m_c", m_c, 1)
    speed = np.abs(np.asarray(speed, dtype=np.float64))
    in_minimum_time = speed / unit_velocity(counts_per_rev, tick_seconds) * m_c
    with np.errstate(divide="ignore"):
        return m_c * (np.floor(in_minimum_time) + 1) / in_minimum_time


def tsuji_eq18_resolution(m_s: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (18) of Tsuji 2009: resolution Q_V = ω_u/(m_s·(m_s − 1)) of the S method; infinite for m_s = 1.

    The supremum of the errors of windows from alteration to alteration at constant speed; not of forced updates.
    """
    return _interval_resolution(m_s, counts_per_rev, tick_seconds)


def tsuji_eq19_measurement_time(m_s: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (19) of Tsuji 2009: measurement time T_m = m_s·T_s of the S method."""
    return _duration("m_s", m_s, tick_seconds)


def tsuji_eq20_interval(speed: ArrayLike, counts_per_rev: ArrayLike, tick_seconds: ArrayLike) -> Floats:
    """Compute eq. (20) of Tsuji 2009: mean m_s = 1/|ω/ω_u − ⌊ω/ω_u + ½⌋| in ticks; infinite at multiples of ω_u."""
    units = np.asarray(speed, dtype=np.float64) / unit_velocity(counts_per_rev, tick_seconds)
    with np.errstate(divide="ignore"):
        return 1 / np.abs(units - np.floor(units + 0.5))
