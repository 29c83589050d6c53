"""A plan keeps its promises, measured on the golden model with ideal pulse numbers."""

from dataclasses import replace
from fractions import Fraction as F
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim.golden.methods.s import Model
from tachometry.sim.signals.run import Table
from tachometry.sim.studies.plan import Plan, Plans, default_range, dense_speeds, plan_at
from tachometry.spec import Encoder, Speed, STachometer, Timing

SPEC = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 50), frac_bits=24)
HALF_LSB = 2.0 ** -(SPEC.velocity.frac_bits + 1)


def with_max_ticks(max_ticks: int, *, cancel: bool = True) -> STachometer:
    return replace(SPEC, timing=replace(SPEC.timing, max_ticks=max_ticks), cancel=cancel)


def updates_of(spec: STachometer, m_e: NDArray[np.int64]) -> Table:
    """Return what the golden model makes of pulse numbers; `clock` is the tick that caused the update."""
    ticks = Table(np.arange(len(m_e)), {"pulse_count": m_e})
    updates = Model(spec).updates(ticks, None, len(m_e) + spec.latency.datapath)
    return updates.having(clock=updates.clock - spec.latency.datapath)


def measure(spec: STachometer, units: F, n_ticks: int = 30_000) -> tuple[Table, NDArray[np.float64]]:
    """Return settled updates at a speed in counts per tick, to the count, and their errors in the same unit."""
    position = (np.arange(n_ticks + 1) * units.numerator + units.denominator // 3) // units.denominator
    updates = updates_of(spec, np.diff(position))
    updates = updates.rows(updates.clock > 200)  # more than two windows, and two equal pulse numbers
    return updates, np.abs(updates.velocity / 2.0**spec.velocity.frac_bits - float(units))


def plan_in_units(spec: STachometer, units: F) -> Plan:
    return plan_at(spec, [float(units) * spec.scale.unit_velocity])


@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize(
    "units", [F(1, 50), F(1, 7), F(13, 40), F(1, 2), 1 - F(1, 50), 3 + F(1, 50), 3 + F(1, 4), F(1749, 100)]
)
def test_updates_by_alteration(units: F, cancel: bool) -> None:
    spec = with_max_ticks(50, cancel=cancel)
    expected = plan_in_units(spec, units)
    updates, error = measure(spec, units)
    assert not expected.forced[0]
    assert not updates.forced.any()
    assert updates.interval.mean() == pytest.approx(expected.interval[0], abs=1 / len(updates.interval))
    assert expected.interval[0] == pytest.approx(float(1 / abs(units - round(units))))
    assert expected.measurement_time[0] == pytest.approx(20e-6 * expected.interval[0])
    assert error.max() <= expected.resolution[0] / spec.scale.unit_velocity + HALF_LSB


@pytest.mark.parametrize("max_ticks", [2, 9, 50])
@pytest.mark.parametrize("cancel", [True, False])
def test_forced_updates(max_ticks: int, cancel: bool) -> None:
    spec = with_max_ticks(max_ticks, cancel=cancel)
    beside = [F(1, max_ticks + 1), F(5, 7 * max_ticks + 3), F(1, 3 * max_ticks - 1), F(1, 10 * max_ticks + 3)]
    distances = [F(0), *beside, *(-distance for distance in beside)]
    used = 0.0
    for units in (multiple + distance for multiple in (0, 1, 17) for distance in distances):
        if units <= 0:
            continue
        expected = plan_in_units(spec, units)
        updates, error = measure(spec, units)
        assert expected.forced[0]
        assert updates.forced.any()
        assert expected.interval[0] == updates.interval.max() == max_ticks
        bound = expected.resolution[0] / spec.scale.unit_velocity
        assert error.max() <= bound + HALF_LSB
        used = max(used, error.max() / bound)
    assert bound == pytest.approx(1 / max_ticks if cancel else 1 / (max_ticks // 2 + 1))
    assert used > 0.4


def test_plain_averaging_needs_the_wider_bound() -> None:
    _, error = measure(with_max_ticks(50, cancel=False), F(1, 503))
    assert error.max() > 1.5 / 50


def test_unevenly_long_intervals_stay_within_the_resolution_of_their_mean() -> None:
    rng = np.random.default_rng(3)
    for units in (F(int(n), 10_007) for n in rng.integers(210, 50_000, size=40)):
        expected = plan_in_units(SPEC, units)
        _, error = measure(SPEC, units, 5000)
        assert error.max() <= expected.resolution[0] / SPEC.scale.unit_velocity + HALF_LSB, units


@pytest.mark.parametrize("cancel", [True, False])
@pytest.mark.parametrize("max_ticks", [2, 3, 8, 9])
def test_standstill(max_ticks: int, cancel: bool) -> None:
    spec = with_max_ticks(max_ticks, cancel=cancel)
    rng = np.random.default_rng(max_ticks)
    longest = 0
    for _ in range(200):
        moving = rng.integers(-1, 3, size=rng.integers(1, 20))
        m_e = np.concatenate([moving, [1], np.zeros(4 * max_ticks, dtype=np.int64)])
        updates = updates_of(spec, m_e)
        last = updates.clock[np.flatnonzero(updates.velocity)[-1]]
        zero = updates.clock[updates.clock > last][0]
        longest = max(longest, zero - len(moving))
    assert longest <= spec.times.standstill_ticks
    if cancel:
        assert longest == spec.times.standstill_ticks


@pytest.mark.parametrize(
    ("max_speed", "tick_cycles", "low", "high"),
    [
        (None, 960, 1 / 50, 10),
        (None, 4, 1 / 50, 4),  # one count per clock
        ("75rev/s", 960, 1 / 50, 3),
        ("70rev/s", 960, 1 / 50, 2.8),
        ("0.25rev/s", 960, 0.001, 0.01),  # slower than one count in the maximum time
        ("1e9rpm", 960, 1 / 50, 960),
    ],
)
def test_default_range(max_speed: str | None, tick_cycles: int, low: float, high: float) -> None:
    timing = Timing(tick_cycles * 50_000, tick_cycles, 50)
    spec = replace(SPEC, timing=timing, max_speed=None if max_speed is None else Speed.parse(max_speed))
    assert default_range(spec) == pytest.approx((low * spec.scale.unit_velocity, high * spec.scale.unit_velocity))


def test_one_count_in_the_maximum_time_is_an_alteration() -> None:
    for max_ticks in (*range(2, 100), *range(100, 2001, 19)):
        spec = with_max_ticks(max_ticks)
        assert not plan_at(spec, spec.scale.unit_velocity / max_ticks).forced


def test_dense_speeds_meet_every_peak() -> None:
    unit = SPEC.scale.unit_velocity
    speed = dense_speeds(SPEC, 0.03 * unit, 7.2 * unit)
    assert (speed[0], speed[-1]) == (0.03 * unit, 7.2 * unit)
    assert np.all(np.diff(speed) > 0)
    expected = plan_at(SPEC, speed)
    for multiple in range(1, 8):
        near = np.abs(expected.counts_per_tick - multiple) <= 0.5
        assert expected.forced[near].sum() >= 3
        assert expected.interval[near & ~expected.forced].max() > 49.99
        assert expected.interval[near].min() == pytest.approx(2, abs=0.01) or multiple == 7


@pytest.mark.parametrize("high", [1.0, 100.0, 1e6])
def test_dense_speeds_are_not_too_many(high: float) -> None:
    assert len(dense_speeds(SPEC, 1e-9 * SPEC.scale.unit_velocity, high * SPEC.scale.unit_velocity)) < 40_000


def test_csv(tmp_path: Path) -> None:
    plans = Plans(SPEC, {}, 1.0, 1000.0)
    expected = plans.line
    plans.write(tmp_path / "p.csv")
    table = np.genfromtxt(tmp_path / "p.csv", delimiter=",", names=True)
    assert table["speed_rad_s"].tolist() == expected.speed.tolist()
    assert table["interval_ticks"].tolist() == expected.interval.tolist()
    assert table["measurement_time_s"].tolist() == expected.measurement_time.tolist()
    assert table["forced"].tolist() == expected.forced.tolist()
    assert np.allclose(table["relative_resolution"] * table["speed_rad_s"], expected.resolution)
    assert np.allclose(table["counts_per_tick"] * SPEC.scale.unit_velocity, expected.speed)
