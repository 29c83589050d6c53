"""Equations of Rairán 2013: estimates, their relative errors, delay and greatest acceleration.

Every function is vectorised: arguments are broadcast against each other, and the result has their shape, float64.
Estimates n are in units of ω_lim = 1/(pul·dt): n1 = 1/Ndt1 at low speeds, Nep1 at high ones. Relative errors are
fractions of the speed, where the paper prints them in per cent. A `speed` ω is more than 0, in the unit of its
`speed_limit` ω_lim; `pulses_per_rev` is pul; dt is in seconds where no other unit is named. What is out of range raises
ValueError.

Low and high are told apart by the estimate, which is known, not by the speed, which is not: n1 ≤ 1 is low. So ω_lim
itself, where n1 = 1, is low, with n2 = ½; eq. (5) to the letter would make it high, with n2 = 0.
"""

import numpy as np
from numpy.typing import ArrayLike

from tachometry.sim.theory.checks import Floats, in_a_regime, positive


def _regime_n1(n1: ArrayLike) -> Floats:
    return in_a_regime("n1", n1, 1, 2)


def _regime_n2(n2: ArrayLike) -> Floats:
    return in_a_regime("n2", n2, 1 / 2, 1)


def rairan_speed_limit(pulses_per_rev: ArrayLike, dt: ArrayLike) -> Floats:
    """Return ω_lim = 1/(pul·dt) in rev/s: one pulse per dt (Rairán 2013, introduction); dt in seconds."""
    return 1 / (positive("pulses_per_rev", pulses_per_rev) * positive("dt", dt))


def rairan_eq01_update_time(speed: ArrayLike, speed_limit: ArrayLike, dt: ArrayLike) -> Floats:
    """Compute eq. (1) of Rairán 2013: time dt_a = (−r/⌊r⌋ + 2 + 1/⌊r⌋)·dt between updates, r = ω/ω_lim; in the unit of
    dt.

    Below ω_lim it is the time between two pulses. It joins the values of `rairan_update_time` at the multiples of ω_lim
    by straight lines.
    """
    ratio = positive("speed", speed) / positive("speed_limit", speed_limit)
    whole = np.maximum(np.floor(ratio), 1)
    return np.where(ratio < 1, 1 / ratio, 2 + (1 - ratio) / whole) * positive("dt", dt)


def rairan_update_time(speed: ArrayLike, speed_limit: ArrayLike, dt: ArrayLike) -> Floats:
    """Return time (⌊r⌋ + 1)/r·dt between updates of Table 1 of Rairán 2013, r = ω/ω_lim; in the unit of dt.

    A window begins with a pulse and takes dt; the first pulse later than that begins the next. Below ω_lim, where
    ⌊r⌋ = 0, it is the time between two pulses. At the multiples of ω_lim a pulse that comes with the end of dt belongs
    to no window; where it is taken into the next one, the time is dt.
    """
    ratio = positive("speed", speed) / positive("speed_limit", speed_limit)
    return (np.floor(ratio) + 1) / ratio * positive("dt", dt)


def rairan_eq03_error(n1: ArrayLike, speed: ArrayLike, speed_limit: ArrayLike) -> Floats:
    """Compute eq. (3) of Rairán 2013: relative error n1·ω_lim/ω − 1 of the upper estimate n1, never below ω."""
    return _regime_n1(n1) * positive("speed_limit", speed_limit) / positive("speed", speed) - 1


def rairan_eq04_max_error(n1: ArrayLike) -> Floats:
    """Compute eq. (4) of Rairán 2013: bound of eq. (3) over all speeds of an estimate: n1 if n1 ≤ 1, else 1/(n1 − 1).

    Attained for n1 ≤ 1, whose interval has its left end, n2; a supremum above, where it has not.
    """
    n1 = _regime_n1(n1)
    return np.where(n1 < 1.5, n1, 1 / np.maximum(n1 - 1, 0.5))


def rairan_eq05_n2(n1: ArrayLike) -> Floats:
    """Compute eq. (5) of Rairán 2013: lower estimate n2 = 1/(1/n1 + 1) if n1 ≤ 1, else n1 − 1; never above ω."""
    n1 = _regime_n1(n1)
    return np.where(n1 < 1.5, 1 / (1 / n1 + 1), n1 - 1)


def rairan_eq08_sup_error(n2: ArrayLike) -> Floats:
    """Compute eq. (8) of Rairán 2013: bound of the error 1 − n2·ω_lim/ω: n2 if n2 ≤ ½, else 1/(n2 + 1).

    A supremum at low speeds, but attained at ω_lim (n2 = ½), and in every interval of high speeds, which has its right
    end, n1.
    """
    n2 = _regime_n2(n2)
    return np.where(n2 < 0.75, n2, 1 / (n2 + 1))


def rairan_eq11_n3(n1: ArrayLike, n2: ArrayLike) -> Floats:
    """Compute eq. (11) of Rairán 2013: optimal estimate n3 = 2/(1/n1 + 1/n2), whose errors at n1 and n2 are equal."""
    return 2 / (1 / _regime_n1(n1) + 1 / _regime_n2(n2))


def rairan_eq13_max_error(n1: ArrayLike) -> Floats:
    """Compute eq. (13) of Rairán 2013: greatest error of n3: 1/(1 + 2/n1) if n1 ≤ 1, else 1/(2·n1 − 1); attained."""
    n1 = _regime_n1(n1)
    return np.where(n1 < 1.5, 1 / (1 + 2 / n1), 1 / np.maximum(2 * n1 - 1, 1))


def rairan_eq14_max_acceleration(n1: ArrayLike, pulses_per_rev: ArrayLike, dt: ArrayLike) -> Floats:
    """Compute eq. (14) of Rairán 2013: a_max = ω_lim/(2·dt), at low speeds over Ndt1·(Ndt1 + 1), Ndt1 = 1/n1; in
    rev/s².

    At low speeds it is (Ndt1 + 1)/2 times the acceleration that changes the speed by n1 − n2 in the longest window.
    """
    n1 = _regime_n1(n1)
    n_dt1 = 1 / n1
    dt = positive("dt", dt)
    return rairan_speed_limit(pulses_per_rev, dt) / (2 * dt * np.where(n1 < 1.5, n_dt1 * (n_dt1 + 1), 1))
