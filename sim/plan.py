"""What the S method promises at each speed, from the equations alone."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.tables import write_csv
from tachometry.sim.theory import (
    tsuji_eq18_resolution,
    tsuji_eq19_measurement_time,
    tsuji_eq20_interval,
    unit_velocity,
)
from tachometry.spec import STachometer

# An interval of just `max_ticks`, at one count in the maximum time, is to be no longer for the rounding of a double.
_SLACK = 1e-9

_UNITS = 10  # of the default range
_STEADY, _MULTIPLES, _DISTANCES = 1000, 1000, 16  # samples: speeds, multiples of ω_u, distances from each of them


@dataclass(frozen=True)
class Plan:
    """Measurements to be expected at constant speeds of an ideal encoder, once the first two windows are over.

    Parameters
    ----------
    speed : float64 array, shape (n,), rad/s
    counts_per_tick : float64 array, shape (n,)
        ω/ω_u.
    interval : float64 array, shape (n,), ticks
        Mean m_s; the maximum where updates are forced.
    measurement_time : float64 array, shape (n,), seconds
        T_m.
    resolution : float64 array, shape (n,), rad/s
        Q_V. No error is greater, but for the rounding, once two successive ticks have counted alike.
    forced : bool array, shape (n,)
        Alterations are farther apart than the maximum time.
    """

    speed: NDArray[np.float64]
    counts_per_tick: NDArray[np.float64]
    interval: NDArray[np.float64]
    measurement_time: NDArray[np.float64]
    resolution: NDArray[np.float64]
    forced: NDArray[np.bool_]


def plan_at(spec: STachometer, speed: ArrayLike) -> Plan:
    """What to expect at speeds in rad/s: Tsuji 2009, eqs. (18) to (20).

    Nearer to a multiple of ω_u than ω_u/max_ticks, updates are forced, and eq. (18) does not hold. With m_s ≥ kept + 1
    in the window after a forced one, in which eq. (21) weights the only alteration by one half and eq. (17) by one, the
    error is at most ω_u/max_ticks with eq. (21), ω_u/(kept + 1) with eq. (17).
    """
    max_ticks, counts_per_rev = spec.timing.max_ticks, spec.encoder.counts_per_rev
    tick_seconds = float(spec.timing.tick_seconds)
    speed = np.asarray(speed, dtype=np.float64)
    m_s = tsuji_eq20_interval(speed, counts_per_rev, tick_seconds)
    forced = m_s > max_ticks * (1 + _SLACK)
    m_s = np.minimum(m_s, max_ticks)
    unit = unit_velocity(counts_per_rev, tick_seconds)
    return Plan(
        speed=speed,
        counts_per_tick=speed / unit,
        interval=m_s,
        measurement_time=tsuji_eq19_measurement_time(m_s, tick_seconds),
        resolution=np.where(
            forced,
            unit / (max_ticks if spec.cancel else spec.kept_ticks + 1),
            tsuji_eq18_resolution(m_s, counts_per_rev, tick_seconds),
        ),
        forced=forced,
    )


def standstill_ticks(spec: STachometer) -> int:
    """Ticks from that of the last count to the one whose update reads 0, at most: 1.5·max_ticks, rounded up.

    The count opens a window; the forced update at its end still weights it by one half, the next has it no more.
    """
    return 2 * spec.timing.max_ticks - spec.kept_ticks


def default_range(spec: STachometer) -> tuple[float, float]:
    """Least and greatest speed, in rad/s, that a plan is of interest for.

    From one count in the maximum time to `max_speed`; without it, as everything recurs in each multiple of ω_u, to ten
    of them. Never beyond one count per clock, and over a decade at least.
    """
    unit = spec.unit_velocity
    high = _UNITS * unit if spec.max_speed is None else spec.max_speed.rad_per_s
    high = min(high, spec.greatest_speed)
    return min(unit / spec.timing.max_ticks, high / 10), high


def dense_speeds(spec: STachometer, low: float, high: float) -> NDArray[np.float64]:
    """Speeds from `low` to `high`, rad/s, that show all a line can: both ends, and where it goes at multiples of ω_u.

    Evenly spaced logarithms, and around every multiple of ω_u, or as many as a figure can tell apart, evenly spaced
    logarithms of the distance to it, down to where updates are forced.
    """
    unit = spec.unit_velocity
    steady = np.geomspace(low, high, _STEADY)
    multiples = np.unique(np.floor(np.geomspace(low, high, _MULTIPLES) / unit + 0.5))
    edge = 1 / spec.timing.max_ticks
    beside = np.append(np.geomspace(edge * (1 + 1e-6), 0.5, _DISTANCES), edge * (1 - 1e-6))
    distances = np.concatenate([-beside, [0], beside])
    near = (multiples[:, np.newaxis] + distances).ravel() * unit
    return np.unique(np.concatenate([steady, near[(near > low) & (near < high)]]))


def write_plan(path: Path, plan: Plan) -> None:
    """Write a CSV with a row per speed."""
    write_csv(
        path,
        "speed_rad_s,counts_per_tick,interval_ticks,measurement_time_s,resolution_rad_s,relative_resolution,forced",
        (
            plan.speed,
            plan.counts_per_tick,
            plan.interval,
            plan.measurement_time,
            plan.resolution,
            plan.resolution / plan.speed,
            plan.forced.astype(np.int64),
        ),
    )
