"""What the methods promise at each speed, from the equations alone."""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.signals.tables import write_csv
from tachometry.sim.theory.performance import (
    Performance,
    m_performance,
    mt_performance,
    rairan_performance,
    s_performance,
    t_performance,
)
from tachometry.sim.theory.tsuji import unit_velocity
from tachometry.spec import MTachometer, MTTachometer, RairanTachometer, STachometer, TachometerSpec
from tachometry.spec.methods.timed import TimedTachometer

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
        Q_V. No error is greater, but for the rounding, once the method has settled (the S method: once two successive
        ticks have counted alike). NaN, as the times, where the method cannot measure.
    forced : bool array, shape (n,)
        The maximum time ends the measurement.
    """

    speed: NDArray[np.float64]
    counts_per_tick: NDArray[np.float64]
    interval: NDArray[np.float64]
    measurement_time: NDArray[np.float64]
    resolution: NDArray[np.float64]
    forced: NDArray[np.bool_]

    @property
    def relative(self) -> NDArray[np.float64]:
        """Q_V/V."""
        return self.resolution / self.speed

    @property
    def product(self) -> NDArray[np.float64]:
        """Q_V·T_m in rad: what is paid in time for resolution (Tsuji 2009, Sec. V-C)."""
        return self.resolution * self.measurement_time


def plan_at(spec: TachometerSpec, speed: ArrayLike) -> Plan:
    """What to expect of a core at speeds in rad/s, from the equations of its method, see `sim.theory.performance`.

    The S method nearer to a multiple of ω_u than ω_u/max_ticks: updates are forced, and eq. (18) does not hold. With
    m_s ≥ kept + 1 in the window after a forced one, in which eq. (21) weights the only alteration by one half and
    eq. (17) by one, the error is at most ω_u/max_ticks with eq. (21), ω_u/(kept + 1) with eq. (17).
    """
    speed = np.atleast_1d(np.asarray(speed, dtype=np.float64))
    tick_seconds = float(spec.timing.tick_seconds)
    found = _performance(spec, speed, tick_seconds)
    return Plan(
        speed=speed,
        counts_per_tick=speed / unit_velocity(spec.encoder.counts_per_rev, tick_seconds),
        interval=found.time / tick_seconds,
        measurement_time=found.time,
        resolution=found.resolution,
        forced=found.forced,
    )


def _performance(spec: TachometerSpec, speed: NDArray[np.float64], tick_seconds: float) -> Performance:
    counts, longest = spec.encoder.counts_per_rev, spec.timing.max_ticks
    if isinstance(spec, STachometer):
        found = s_performance(speed, counts, tick_seconds, longest)
        if spec.cancel:
            return found
        worst = unit_velocity(counts, tick_seconds) / (spec.kept_ticks + 1)
        return replace(found, resolution=np.where(found.forced, worst, found.resolution))
    if isinstance(spec, MTachometer):
        return m_performance(speed, spec.average, counts, tick_seconds)
    if isinstance(spec, RairanTachometer):
        if spec.adaptive is None:
            return rairan_performance(speed, spec.estimate, counts, tick_seconds, longest)
        shift = _steady_shift(spec, speed / spec.unit_velocity)
        each = [
            rairan_performance(speed, spec.estimate, counts, tick_seconds * 2**k, longest >> k)
            for k in range(spec.max_shift + 1)
        ]
        columns = (
            np.choose(shift, [getattr(found, name) for found in each]) for name in ("resolution", "time", "forced")
        )
        return Performance(*columns)
    assert isinstance(spec, TimedTachometer)
    timer_seconds, longest = tick_seconds / spec.timer_periods, spec.max_periods
    if isinstance(spec, MTTachometer):
        return mt_performance(speed, spec.min_periods, counts, timer_seconds, longest)
    return t_performance(speed, counts, timer_seconds, longest)


def _steady_shift(spec: RairanTachometer, ratio: NDArray[np.float64]) -> NDArray[np.int64]:
    """k of an adaptive dt that comes from shorter ones, at speeds in counts per tick."""
    rule = spec.adaptive_dt
    doubled = np.ceil(np.log2((rule.fewest - 1) / ratio) + 1e-12)
    return np.where(ratio * rule.slow <= 1, 0, np.clip(doubled, 0, rule.max_shift)).astype(np.int64)


def standstill_ticks(spec: STachometer) -> int:
    """Ticks from that of the last count to the one whose update reads 0, at most: 1.5·max_ticks, rounded up.

    The count opens a window; the forced update at its end still weights it by one half, the next has it no more.
    """
    return 2 * spec.timing.max_ticks - spec.kept_ticks


def standstill(spec: TachometerSpec) -> int:
    """Ticks from that of the last count to the update that reads 0, at most."""
    if isinstance(spec, STachometer):
        return standstill_ticks(spec)
    return spec.average if isinstance(spec, MTachometer) else spec.timing.max_ticks


def default_range(spec: TachometerSpec) -> tuple[float, float]:
    """Least and greatest speed, in rad/s, that a plan is of interest for.

    From one count in the maximum time to `max_speed`; without it, as everything recurs in each multiple of ω_u, to ten
    of them. Never beyond one count per clock, and over a decade at least.
    """
    unit = spec.unit_velocity
    high = _UNITS * unit if spec.max_speed is None else spec.max_speed.rad_per_s
    high = min(high, spec.greatest_speed)
    return min(unit / spec.timing.max_ticks, high / 10), high


def dense_speeds(spec: TachometerSpec, low: float, high: float) -> NDArray[np.float64]:
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
    write_csv(path, ",".join(_columns(plan)), _columns(plan).values())


def write_plans(path: Path, plans: Mapping[str, Plan]) -> None:
    """Write a CSV with a row per method and speed."""
    columns = [_columns(plan) | {"product_rad": plan.product} for plan in plans.values()]
    names = np.repeat(list(plans), [len(plan.speed) for plan in plans.values()])
    joined = {head: np.concatenate([one[head] for one in columns]) for head in columns[0]}
    rows = zip(names.tolist(), *(column.tolist() for column in joined.values()), strict=True)
    with path.open("w", encoding="ascii", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["method", *joined])
        writer.writerows([name, *map(repr, row)] for name, *row in rows)


def _columns(plan: Plan) -> dict[str, NDArray[Any]]:
    return {
        "speed_rad_s": plan.speed,
        "counts_per_tick": plan.counts_per_tick,
        "interval_ticks": plan.interval,
        "measurement_time_s": plan.measurement_time,
        "resolution_rad_s": plan.resolution,
        "relative_resolution": plan.relative,
        "forced": plan.forced.astype(np.int64),
    }
