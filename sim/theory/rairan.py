"""Equations of Rairán 2013: estimates and the time between updates.

Every function is vectorised: arguments are broadcast against each other, and the result has their shape, float64.
Estimates n are in units of ω_lim = 1/(pul·dt): n1 = 1/Ndt1 at low speeds, Nep1 at high ones. A `speed` ω is more than
0, in the unit of its `speed_limit` ω_lim. What is out of range raises ValueError.

Low and high are told apart by the estimate, which is known, not by the speed, which is not: n1 ≤ 1 is low. So ω_lim
itself, where n1 = 1, is low, with n2 = ½; eq. (5) to the letter would make it high, with n2 = 0.
"""

import numpy as np
from numpy.typing import ArrayLike

from tachometry.sim.theory.checks import Floats, in_a_regime, positive


def regime_n1(n1: ArrayLike) -> Floats:
    """Return upper estimates as an array; ValueError if one is not greater than 0, or lies between the regimes."""
    return in_a_regime("n1", n1, 1, 2)


def regime_n2(n2: ArrayLike) -> Floats:
    """Return lower estimates as an array; ValueError as for `regime_n1`."""
    return in_a_regime("n2", n2, 1 / 2, 1)


def rairan_update_time(speed: ArrayLike, speed_limit: ArrayLike, dt: ArrayLike) -> Floats:
    """Return time (⌊r⌋ + 1)/r·dt between updates of Table 1 of Rairán 2013, r = ω/ω_lim; in the unit of dt.

    A window begins with a pulse and takes dt; the first pulse later than that begins the next. Below ω_lim, where
    ⌊r⌋ = 0, it is the time between two pulses. At the multiples of ω_lim a pulse that comes with the end of dt belongs
    to no window; where it is taken into the next one, the time is dt.
    """
    ratio = positive("speed", speed) / positive("speed_limit", speed_limit)
    return (np.floor(ratio) + 1) / ratio * positive("dt", dt)


def rairan_eq05_n2(n1: ArrayLike) -> Floats:
    """Compute eq. (5) of Rairán 2013: lower estimate n2 = 1/(1/n1 + 1) if n1 ≤ 1, else n1 − 1; never above ω."""
    n1 = regime_n1(n1)
    return np.where(n1 < 1.5, 1 / (1 / n1 + 1), n1 - 1)


def rairan_eq11_n3(n1: ArrayLike, n2: ArrayLike) -> Floats:
    """Compute eq. (11) of Rairán 2013: optimal estimate n3 = 2/(1/n1 + 1/n2), whose errors at n1 and n2 are equal."""
    return 2 / (1 / regime_n1(n1) + 1 / regime_n2(n2))
