"""Further equations of Rairán 2013, and its Table 1 to the letter, from event to event.

Errors are fractions of the speed, where the paper prints them in per cent; `pulses_per_rev` is pul; dt is in seconds
where no other unit is named. See `tachometry.sim.theory.rairan` for all else.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tachometry.sim.theory.checks import Floats, positive
from tachometry.sim.theory.rairan import regime_n1, regime_n2


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


def rairan_eq03_error(n1: ArrayLike, speed: ArrayLike, speed_limit: ArrayLike) -> Floats:
    """Compute eq. (3) of Rairán 2013: relative error n1·ω_lim/ω − 1 of the upper estimate n1, never below ω."""
    return regime_n1(n1) * positive("speed_limit", speed_limit) / positive("speed", speed) - 1


def rairan_eq04_max_error(n1: ArrayLike) -> Floats:
    """Compute eq. (4) of Rairán 2013: bound of eq. (3) over all speeds of an estimate: n1 if n1 ≤ 1, else 1/(n1 − 1).

    Attained for n1 ≤ 1, whose interval has its left end, n2; a supremum above, where it has not.
    """
    n1 = regime_n1(n1)
    return np.where(n1 < 1.5, n1, 1 / np.maximum(n1 - 1, 0.5))


def rairan_eq08_sup_error(n2: ArrayLike) -> Floats:
    """Compute eq. (8) of Rairán 2013: bound of the error 1 − n2·ω_lim/ω: n2 if n2 ≤ ½, else 1/(n2 + 1).

    A supremum at low speeds, but attained at ω_lim (n2 = ½), and in every interval of high speeds, which has its right
    end, n1.
    """
    n2 = regime_n2(n2)
    return np.where(n2 < 0.75, n2, 1 / (n2 + 1))


def rairan_eq13_max_error(n1: ArrayLike) -> Floats:
    """Compute eq. (13) of Rairán 2013: greatest error of n3: 1/(1 + 2/n1) if n1 ≤ 1, else 1/(2·n1 − 1); attained."""
    n1 = regime_n1(n1)
    return np.where(n1 < 1.5, 1 / (1 + 2 / n1), 1 / np.maximum(2 * n1 - 1, 1))


def rairan_eq14_max_acceleration(n1: ArrayLike, pulses_per_rev: ArrayLike, dt: ArrayLike) -> Floats:
    """Compute eq. (14) of Rairán 2013: a_max = ω_lim/(2·dt), at low speeds over Ndt1·(Ndt1 + 1), Ndt1 = 1/n1; in
    rev/s².

    At low speeds it is (Ndt1 + 1)/2 times the acceleration that changes the speed by n1 − n2 in the longest window.
    """
    n1 = regime_n1(n1)
    n_dt1 = 1 / n1
    dt = positive("dt", dt)
    return rairan_speed_limit(pulses_per_rev, dt) / (2 * dt * np.where(n1 < 1.5, n_dt1 * (n_dt1 + 1), 1))


@dataclass(frozen=True)
class Row:
    """Holds the entries of Table 1 after an event."""

    time: int  # ts
    # pulse and end: a pulse came (lep), dt ended
    pulse: bool
    end: bool
    # c_ep, c_dt, n_ep1 and n_dt1: Cep, Cdt, Nep1, Ndt1
    c_ep: int
    c_dt: int
    n_ep1: int
    n_dt1: int
    # new_n_ep1 and new_n_dt1: Nep1 (line 9), Ndt1 (line 6) was updated
    new_n_ep1: bool = False
    new_n_dt1: bool = False

    @property
    def n1(self) -> float:
        """The estimate Nep1/Ndt1."""
        return self.n_ep1 / self.n_dt1


def table1_rows(pulses: Iterable[int], dt: int, duration: int) -> list[Row]:
    """Return every event of Table 1, its start first; the lines are those of the paper, in its order.

    - `pulses`, ts, increasing and greater than 0
    - `dt`, ts
    - `duration`, ts
    """
    rows = [Row(0, False, False, 0, 0, 0, 1)]
    coming = iter(pulses)
    pulse = next(coming, duration + 1)
    c_ep = c_dt = n_ep1 = start = 0  # clock is time − start
    n_dt1 = 1
    while (time := min(pulse, start + dt)) <= duration:
        lep = time == pulse
        new_n_dt1 = lep and c_dt != 0
        if new_n_dt1:  # 5 to 7
            n_dt1, start = c_dt, time
        end = time == start + dt
        new_n_ep1 = end and c_ep != 0
        if new_n_ep1:  # 8, 9
            n_ep1 = c_ep
        if lep:  # 10, 11
            c_ep, c_dt = c_ep + 1, 0
            pulse = next(coming, duration + 1)
        if end:  # 12 to 14
            c_dt, c_ep, start = c_dt + 1, 0, time
        rows.append(Row(time, lep, end, c_ep, c_dt, n_ep1, n_dt1, new_n_ep1, new_n_dt1))
    return rows
