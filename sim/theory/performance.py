"""At a constant speed each method has a resolution Q_V and a measurement time T_m, and an error with a real disc.

All are vectorised over the speeds, in rad/s and greater than 0. `max_ticks` is the maximum measurement time, after
which a value is given by force (Sec. V-B); None: there is none.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.theory import rairan, tracking, tsuji
from tachometry.sim.theory.checks import Floats
from tachometry.spec import (
    MTachometer,
    MTTachometer,
    RairanTachometer,
    STachometer,
    TachometerSpec,
    TrackTachometer,
    TTachometer,
)
from tachometry.spec.core.extras.disc import DiscMap

# An interval of just `max_ticks` is to be no longer for the rounding of a double.
_SLACK = 1e-9

# A real disc, with the options of the virtual encoder: what `tachometry compare` calls a real encoder.
REAL_DISC = {"jitter": 0.05, "nonuniformity": 0.1, "phase_error_deg": 10.0}
_DEVIATIONS = 3  # of what is random and has no bound
# Of positions that are read: LSB a tick below which their steps are taken for motion, and what error that makes; what
# the recursion rounds by, as a power of two below its count. Golden models of 12 to 23 bits have no more.
_STEPS, _ROUNDED = (1 / 50, 1 / 30), 6


@dataclass(frozen=True, eq=False)
class Performance:
    """Holds the figures of a method at each speed."""

    resolution: Floats  # shape (n,), rad/s: Q_V. NaN where the method cannot measure.
    time: Floats  # shape (n,), seconds: T_m, mean
    forced: NDArray[np.bool_]  # shape (n,): the maximum time ends the measurement


def m_performance(speed: Floats, n: int, counts_per_rev: float, tick_seconds: float) -> Performance:
    """Return M method, mean of n ticks: eqs. (7) and (8)."""
    like = np.ones_like(speed)
    return Performance(
        tsuji.tsuji_eq07_resolution(n, counts_per_rev, tick_seconds) * like,
        tsuji.tsuji_eq08_measurement_time(n, tick_seconds) * like,
        np.zeros(len(speed), dtype=np.bool_),
    )


def t_performance(
    speed: Floats, counts_per_rev: float, tick_seconds: float, max_ticks: int | None = None
) -> Performance:
    """Return T method: eqs. (10) to (12); above one count per tick it cannot measure."""
    m_s = tsuji.tsuji_eq12_interval(speed, counts_per_rev, tick_seconds)
    measured = m_s >= 1
    m_s, forced = _limited(np.where(measured, m_s, 1), max_ticks)
    resolution = tsuji.tsuji_eq10_resolution(m_s, counts_per_rev, tick_seconds)
    time = tsuji.tsuji_eq11_measurement_time(m_s, tick_seconds)
    return Performance(
        np.where(measured, _or_forced(resolution, forced, max_ticks, counts_per_rev, tick_seconds), math.nan),
        np.where(measured, time, math.nan),
        forced,
    )


def mt_performance(
    speed: Floats,
    m_c: int,
    counts_per_rev: float,
    tick_seconds: float,
    max_ticks: int | None = None,
    cycle_counts: int = 1,
) -> Performance:
    """Return M/T method with the minimum time of m_c ticks: eqs. (14) to (16).

    Measurements of `cycle_counts` counts or more last a multiple of them.
    """
    m_s = tsuji.tsuji_eq16_interval(speed, m_c, counts_per_rev, tick_seconds)
    counted = np.rint(speed / tsuji.unit_velocity(counts_per_rev, tick_seconds) * m_s)
    more = np.where(counted < cycle_counts, 0, -counted % cycle_counts)
    counted, m_s = counted + more, m_s * (1 + more / np.maximum(counted, 1))
    m_s, forced = _limited(m_s, max_ticks)
    resolution = tsuji.tsuji_eq14_resolution(counted, m_s, m_c, counts_per_rev, tick_seconds)
    return Performance(
        _or_forced(resolution, forced, max_ticks, counts_per_rev, tick_seconds),
        tsuji.tsuji_eq15_measurement_time(m_s, tick_seconds),
        forced,
    )


def s_performance(
    speed: Floats, counts_per_rev: float, tick_seconds: float, max_ticks: int | None = None
) -> Performance:
    """Return S method with eq. (21): eqs. (18) to (20); where it is forced the error is at most ω_u/max_ticks."""
    m_s, forced = _limited(tsuji.tsuji_eq20_interval(speed, counts_per_rev, tick_seconds), max_ticks)
    return Performance(
        _or_forced(
            tsuji.tsuji_eq18_resolution(m_s, counts_per_rev, tick_seconds),
            forced,
            max_ticks,
            counts_per_rev,
            tick_seconds,
        ),
        tsuji.tsuji_eq19_measurement_time(m_s, tick_seconds),
        forced,
    )


def rairan_performance(
    speed: Floats, estimate: str, counts_per_rev: float, dt_seconds: float, max_dt: int | None = None
) -> Performance:
    """Return Rairán 2013: Q_V is the greatest error of the estimate n1, n2 or n3 in its interval, T_m the time of Table
    1.

    The interval is [n2, n1], eq. (5); n3, eq. (11), is nearer to n2. Where the maximum time ends the measurement, the
    speed is less than Q_V.
    """
    limit = tsuji.unit_velocity(counts_per_rev, dt_seconds)
    ratio = speed / limit
    n1 = np.where(ratio > 1, np.ceil(ratio), 1 / np.maximum(np.ceil(1 / ratio) - 1, 1))
    n2 = rairan.rairan_eq05_n2(n1)
    other = rairan.rairan_eq11_n3(n1, n2) if estimate == "n3" else n2
    dt, forced = _limited(rairan.rairan_update_time(ratio, 1, 1), max_dt)
    return Performance(
        _or_forced((n1 - other) * limit, forced, max_dt, counts_per_rev, dt_seconds), dt * dt_seconds, forced
    )


def _limited(m_s: Floats, max_ticks: int | None) -> tuple[Floats, NDArray[np.bool_]]:
    if max_ticks is None:
        return m_s, np.zeros(m_s.shape, dtype=np.bool_)
    return np.minimum(m_s, max_ticks), m_s > max_ticks * (1 + _SLACK)


def _or_forced(
    resolution: Floats, forced: NDArray[np.bool_], max_ticks: int | None, counts_per_rev: float, tick_seconds: float
) -> Floats:
    if max_ticks is None:
        return resolution
    return np.where(forced, tsuji.unit_velocity(counts_per_rev, tick_seconds) / max_ticks, resolution)


def _of_s(spec: STachometer, speed: Floats) -> Performance:
    """Return S method, with eq. (17) as well.

    Nearer to a multiple of ω_u than ω_u/max_ticks updates are forced, and eq. (18) does not hold. With m_s ≥ kept + 1
    in the window after a forced one, in which eq. (21) weights the only alteration by one half and eq. (17) by one, the
    error is at most ω_u/max_ticks with eq. (21), ω_u/(kept + 1) with eq. (17).
    """
    counts, tick_seconds = float(spec.encoder.counts_per_rev), float(spec.timing.tick_seconds)
    found = s_performance(speed, counts, tick_seconds, spec.timing.max_ticks)
    if spec.cancel:
        return found
    worst = tsuji.unit_velocity(counts, tick_seconds) / (spec.form.kept_ticks + 1)
    return replace(found, resolution=np.where(found.forced, worst, found.resolution))


def _of_m(spec: MTachometer, speed: Floats) -> Performance:
    return m_performance(speed, spec.average, float(spec.encoder.counts_per_rev), float(spec.timing.tick_seconds))


def _of_t(spec: TTachometer, speed: Floats) -> Performance:
    timer_seconds = float(spec.timing.tick_seconds) / spec.form.timer_periods
    return t_performance(speed, float(spec.encoder.counts_per_rev), timer_seconds, spec.form.max_periods)


def _of_mt(spec: MTTachometer, speed: Floats) -> Performance:
    timer_seconds = float(spec.timing.tick_seconds) / spec.form.timer_periods
    return mt_performance(
        speed,
        spec.form.min_periods,
        float(spec.encoder.counts_per_rev),
        timer_seconds,
        spec.form.max_periods,
        spec.form.cycle_counts,
    )


def _of_rairan(spec: RairanTachometer, speed: Floats) -> Performance:
    """Return Rairán's method, also with an adaptive dt that has grown from shorter ones."""
    counts, tick_seconds, longest = (
        float(spec.encoder.counts_per_rev),
        float(spec.timing.tick_seconds),
        spec.timing.max_ticks,
    )
    if spec.adaptive is None:
        return rairan_performance(speed, spec.estimate, counts, tick_seconds, longest)
    shift = _steady_shift(spec, speed / spec.scale.unit_velocity)
    each = [
        rairan_performance(speed, spec.estimate, counts, tick_seconds * 2**k, longest >> k)
        for k in range(spec.times.max_tick_shift + 1)
    ]
    columns = (np.choose(shift, [getattr(found, name) for found in each]) for name in ("resolution", "time", "forced"))
    return Performance(*columns)


def _steady_shift(spec: RairanTachometer, ratio: Floats) -> NDArray[np.int64]:
    """Return k of an adaptive dt that comes from shorter ones, at speeds in counts per tick."""
    rule = spec.form.adaptive_dt
    doubled = np.ceil(np.log2((rule.fewest - 1) / ratio) + 1e-12)
    return np.where(ratio * rule.slow <= 1, 0, np.clip(doubled, 0, rule.max_shift)).astype(np.int64)


def _of_track(spec: TrackTachometer, speed: Floats) -> Performance:
    """Return the tracking method when its memory has grown: an edge is known to half a clock, a read to half an LSB.

    T_m is the memory.
    """
    timing, counts = spec.timing, float(spec.encoder.counts_per_rev)
    tick_seconds = float(timing.tick_seconds)
    memory = float(spec.form.memory_seconds)
    ratio = speed / spec.scale.unit_velocity
    edge_error = ratio / (2 * timing.tick_cycles)  # half a clock, in counts
    slow = 0 * speed
    if (sampled := spec.encoder.sampled) is not None:  # there is a read in each tick
        slow = np.where(ratio < _STEPS[0], _STEPS[1] * spec.scale.unit_velocity, 0.0)
        ratio = 0 * speed + 1
        edge_error = ratio * (1 / 2 + 2.0 ** (sampled.shift - _ROUNDED))
    ticks, forced = _limited(np.maximum(1 / ratio, 1), timing.max_ticks)
    resolution = tracking.errors(ratio * spec.scale.unit_velocity, edge_error, counts, tick_seconds, memory)[1]
    return Performance(
        np.maximum(_or_forced(resolution, forced, timing.max_ticks, counts, tick_seconds), slow),
        ticks * tick_seconds / tracking.share(ratio, tick_seconds, memory),
        forced,
    )


def unknown(spec: TachometerSpec, speed: Floats) -> Performance:
    """Return for a method that has no equations here."""
    nothing = np.full(len(speed), math.nan)
    return Performance(nothing, nothing, np.zeros(len(speed), dtype=np.bool_))


# What a core of a method measures at speeds in rad/s, by the name of the method.
PERFORMANCES: dict[str, Callable[[Any, Floats], Performance]] = {
    "s": _of_s,
    "m": _of_m,
    "t": _of_t,
    "mt": _of_mt,
    "rairan": _of_rairan,
    "track": _of_track,
}


def edges_off(spec: TachometerSpec) -> float | None:
    """Return counts RMS by which counts come off their places in spite of a map of the disc; None: it has no map."""
    found = DiscMap.of(spec.extras)
    return None if found is None else found.edges_off(spec)


def disc_counts(spec: TachometerSpec) -> float:
    """Return by how many counts the distance of two edges of a real disc may be wrong.

    Random parts count three standard deviations; a map of the disc leaves these alone. The phase of B matters where
    edges of both lines are counted, and not where windows last whole cycles.
    """
    if (off := edges_off(spec)) is not None:
        return _DEVIATIONS * math.sqrt(2) * off
    decoding = spec.encoder.decoding
    both = decoding == 4 and not (isinstance(spec, MTTachometer) and spec.whole_cycles)
    quarters = 2 * REAL_DISC["nonuniformity"] + _DEVIATIONS * math.sqrt(2) * REAL_DISC["jitter"]
    return quarters * decoding / 4 + (REAL_DISC["phase_error_deg"] / 90 if both else 0)


def disc_error(spec: TachometerSpec, speed: Floats, found: Performance) -> Floats:
    """Return how much a real disc adds to the greatest error, in rad/s, shape (n,); NaN where a method cannot measure.

    - `found`: Of the core at these speeds, with an ideal disc.

    Notes
    -----
    With windows of ticks the distance is wrong, and their time is right; over all speeds no error is greater, though
    it may be at some. With windows from count to count the time is wrong: of c counts c - d are measured. The tracking
    method learns the phase, and its least squares take the mean of the rest.
    """
    if spec.encoder.sampled is not None:
        return 0 * speed  # it has no disc
    counts, off = float(spec.encoder.counts_per_rev), disc_counts(spec)
    pitch = 2 * math.pi / counts
    if isinstance(spec, TrackTachometer):
        real = math.hypot(REAL_DISC["nonuniformity"] / math.sqrt(3), REAL_DISC["jitter"]) * spec.encoder.decoding / 4
        spread = real if (mapped := edges_off(spec)) is None else mapped
        tick_seconds, memory = float(spec.timing.tick_seconds), float(spec.form.memory_seconds)
        return _DEVIATIONS * tracking.errors(speed, spread, counts, tick_seconds, memory)[0]
    if isinstance(spec, TTachometer | MTTachometer):
        return speed * off / (np.maximum(speed * found.time / pitch, 1) - off)
    return off * pitch / found.time
