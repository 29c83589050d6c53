"""Words of Tsuji 2009 about its figures are computed from the equations."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from tachometry.sim.theory import tsuji
from tachometry.sim.theory.checks import Floats


@dataclass(frozen=True)
class Performance:
    """Resolution in rad/s and measurement time in seconds, at each speed."""

    resolution: Floats
    time: Floats


def t_method(speed: Floats, counts: int, tick: float) -> Performance:
    m_s = tsuji.tsuji_eq12_interval(speed, counts, tick)
    return Performance(tsuji.tsuji_eq10_resolution(m_s, counts, tick), tsuji.tsuji_eq11_measurement_time(m_s, tick))


def mt_method(speed: Floats, m_c: int, counts: int, tick: float) -> Performance:
    m_s = tsuji.tsuji_eq16_interval(speed, m_c, counts, tick)
    pulse_sum = np.rint(speed / tsuji.unit_velocity(counts, tick) * m_s)
    return Performance(
        tsuji.tsuji_eq14_resolution(pulse_sum, m_s, m_c, counts, tick), tsuji.tsuji_eq15_measurement_time(m_s, tick)
    )


def s_method(speed: Floats, counts: int, tick: float) -> Performance:
    m_s = tsuji.tsuji_eq20_interval(speed, counts, tick)
    return Performance(tsuji.tsuji_eq18_resolution(m_s, counts, tick), tsuji.tsuji_eq19_measurement_time(m_s, tick))


def test_fig7_mt_beats_t_from_a_count_in_the_minimum_time_to_the_unit_velocity() -> None:
    """500 counts, 1 ms, T_c = 4 ms; the paper reads 3.2 and 12.5 rad/s off its figure."""
    counts, tick, m_c = 500, 1e-3, 4
    unit = float(tsuji.unit_velocity(counts, tick))
    speed = np.linspace(0.01, unit, 100_000, endpoint=False)
    t, mt = t_method(speed, counts, tick), mt_method(speed, m_c, counts, tick)
    better = mt.resolution < t.resolution * (1 - 1e-9)
    assert speed[better].min() == pytest.approx(3.14, abs=0.005)
    assert speed[better].max() == pytest.approx(12.57, abs=0.005)
    assert np.all(better[speed > unit / m_c])
    np.testing.assert_allclose(mt.resolution[~better], t.resolution[~better])
    np.testing.assert_allclose(mt.time[~better], t.time[~better])
    assert np.all(mt.time[better] > t.time[better])


def test_sec_v_b_s_beats_mt_in_the_same_time_when_more_than_one_count_is_summed() -> None:
    counts, tick, m_c = 500, 1e-3, 4
    m_s = np.arange(m_c, 500)
    s = tsuji.tsuji_eq18_resolution(m_s, counts, tick)
    np.testing.assert_allclose(tsuji.tsuji_eq14_resolution(1, m_s, m_c, counts, tick), s)
    summed = np.arange(2, 100)[:, np.newaxis]
    assert np.all(tsuji.tsuji_eq14_resolution(summed, m_s, m_c, counts, tick) > s)
    # More than one count is summed above one in T_c.
    speed = np.linspace(0.5, 60, 20_000)
    m_s_mt = tsuji.tsuji_eq16_interval(speed, m_c, counts, tick)
    pulse_sum = speed / tsuji.unit_velocity(counts, tick) * m_s_mt
    np.testing.assert_array_equal(pulse_sum > 1.5, speed > 2 * math.pi / (counts * m_c * tick))


def test_fig7_mt_is_coarse_at_high_speeds_and_s_is_not() -> None:
    counts, tick, m_c = 500, 1e-3, 4
    unit = float(tsuji.unit_velocity(counts, tick))
    speed = np.linspace(6 * unit, 20 * unit, 50_001)[1:-1]
    s, mt = s_method(speed, counts, tick), mt_method(speed, m_c, counts, tick)
    np.testing.assert_allclose(mt.resolution, unit / m_c)
    assert np.all(s.resolution <= unit / 2 * (1 + 1e-9))
    # d²/(1 − d) < 1/m_c for a distance of d unit velocities from the nearest multiple
    assert np.mean(s.resolution < mt.resolution) == pytest.approx(2 * (math.sqrt(17) - 1) / 8, abs=1e-3)


def test_fig8_s_against_mt_with_a_timer() -> None:
    """81,000 counts: M/T with 200 ns and T_c = 20 µs against S with 20 µs, compared by Q_V·T_m."""
    counts, tick, timer, m_c = 81_000, 20e-6, 200e-9, 100
    unit = float(tsuji.unit_velocity(counts, tick))
    assert unit == pytest.approx(3.879, abs=1e-3)
    bands, samples = 150, 2000
    units = (np.arange(bands)[:, np.newaxis] + (np.arange(samples) + 0.5) / samples).ravel()
    s, mt = s_method(units * unit, counts, tick), mt_method(units * unit, m_c, counts, timer)
    better = s.resolution * s.time < mt.resolution * mt.time

    # Bands from one multiple of ω_u to the next. The paper says approximately 130 rad/s.
    share = better.reshape(bands, samples).mean(axis=1)
    first = int(np.flatnonzero(share <= 0.5)[-1]) + 1
    assert (first * unit, (first + 1) * unit) == pytest.approx((128.0, 131.9), abs=0.05)
    assert np.all(share[:first] <= 0.5)
    assert share[int(200 / unit)] == pytest.approx(0.69, abs=0.02)
    assert (units * unit)[~better].max() == pytest.approx(382.0, abs=0.1)
    # Below one unit velocity S is the T method with ticks a hundred times as long.
    assert not better[units < 0.5].any()
