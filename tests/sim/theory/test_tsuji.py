"""Equations of Tsuji 2009, against ideal encoders, each other, and the words about its figures."""

import math
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from numpy.typing import NDArray
from reference.ideal_counts import Windows, mt_windows, positions, s_windows, speeds
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.run import Table
from tachometry.sim.theory import tracking, tsuji
from tachometry.spec import Encoder, STachometer, Timing, TrackTachometer

COUNTS, TICK = 500, 1e-3
UNIT = float(tsuji.unit_velocity(COUNTS, TICK))
N_TICKS = 3000
ROUNDING = 1e-9


def windows(kind: Callable[..., Windows], *arguments: int, below: float = math.inf) -> Iterator[tuple[float, Windows]]:
    """Yield speed in unit velocities and windows of each ideal encoder with some hundred counts."""
    for p, q, c in speeds():
        if p / q < below:
            yield p / q, kind(positions(p, q, c, N_TICKS), *arguments)


@pytest.mark.parametrize("n", [1, 4, 50])
def test_averaging_makes_the_error_n_times_smaller(n: int) -> None:
    resolution = tsuji.tsuji_eq07_resolution(n, COUNTS, TICK)
    worst = 0.0
    for p, q, c in speeds():
        position = positions(p, q, c, N_TICKS)
        error = np.abs((position[n:] - position[:-n]) / n - p / q) * UNIT
        assert np.all(error < resolution + ROUNDING)
        worst = max(worst, float(np.max(error / resolution)))
    assert worst > 0.98


def test_t_method_error_and_mean_interval() -> None:
    worst = 0.0
    for units, t in windows(lambda position: mt_windows(position, 1), below=1):
        assert np.all(t.pulse_sum == 1)
        error = np.abs(1 / t.m_s - units) * UNIT
        resolution = tsuji.tsuji_eq10_resolution(t.m_s, COUNTS, TICK)
        assert np.all(error < resolution)
        worst = max(worst, float(np.max(error / resolution)))
        interval = float(tsuji.tsuji_eq12_interval(units * UNIT, COUNTS, TICK))
        assert abs(t.m_s.mean() - interval) < 1 / len(t.m_s)
        assert set(t.m_s) <= {math.floor(interval), math.ceil(interval)}
    assert worst > 0.98


@pytest.mark.parametrize("m_c", only([4], [1, 4, 100]))
def test_mt_method_error_is_less_than_either_term_of_its_resolution(m_c: int) -> None:
    nearest = {True: 0.0, False: 0.0}
    for units, mt in windows(mt_windows, m_c):
        error = np.abs(mt.pulse_sum / mt.m_s - units) * UNIT
        resolution = tsuji.tsuji_eq14_resolution(mt.pulse_sum, mt.m_s, m_c, COUNTS, TICK)
        assert np.all(mt.m_s >= m_c)
        assert np.all(error < resolution)
        by_count = resolution == UNIT / m_c
        for which in (True, False):
            chosen = (error / resolution)[by_count == which]
            nearest[which] = max(nearest[which], float(chosen.max(initial=0)))
    assert nearest[True] > 0.9
    assert nearest[False] > 0.9


@pytest.mark.parametrize("m_c", [1, 4, 100])
def test_mt_method_takes_the_first_count_later_than_its_minimum_time(m_c: int) -> None:
    """Windows told by the exact times of the counts, count k at (k·q + c)/p ticks; whole ticks are summed."""
    for p, q, c in [*speeds(), (3, 4, 0), (2, 1, 0), (5, 1, 0)]:
        number = next(n for n in range(1, 10**6) if n * q > m_c * p)
        assert number == m_c * p // q + 1
        count = np.arange(200) * number
        m_s = np.diff((count * q + c) // p)
        # A hair above p/q, so that rounding cannot take a whole number of counts in T_c for less.
        interval = tsuji.tsuji_eq16_interval(p / q * UNIT * (1 + 1e-13), m_c, COUNTS, TICK)
        assert abs(m_s.mean() - interval) < 1 / len(m_s) + ROUNDING, (p, q)


def test_s_method_error_and_mean_interval() -> None:
    worst = 0.0
    for units, s in windows(s_windows):
        interval = float(tsuji.tsuji_eq20_interval(units * UNIT, COUNTS, TICK))
        if len(s.m_s) == 0:
            assert interval > N_TICKS / 4
            continue
        resolution = tsuji.tsuji_eq18_resolution(s.m_s, COUNTS, TICK)
        assert abs(s.m_s.mean() - interval) <= 1 / len(s.m_s) + ROUNDING
        for counts in (s.pulse_sum, s.pulse_sum + (s.opening - s.closing) / 2):  # eqs. (17) and (21)
            error = np.abs(counts / s.m_s - units) * UNIT
            assert np.all(error < resolution)
            worst = max(worst, float(np.max(error / resolution)))
    assert worst > 0.98


def test_s_method_knows_its_distance_from_the_nearest_multiple() -> None:
    """Eqs. (18) to (20) together, at a distance of d unit velocities: the T method's figures at a speed of d."""
    distance = np.geomspace(1e-3, 0.499, 200)
    multiple = np.arange(12)[:, np.newaxis]
    for units in (multiple + distance, multiple - distance, -multiple - distance):
        m_s = tsuji.tsuji_eq20_interval(units * UNIT, COUNTS, TICK)
        np.testing.assert_allclose(
            m_s, np.broadcast_to(tsuji.tsuji_eq12_interval(distance * UNIT, COUNTS, TICK), m_s.shape), rtol=1e-10
        )
        resolution = tsuji.tsuji_eq18_resolution(m_s, COUNTS, TICK)
        time = tsuji.tsuji_eq19_measurement_time(m_s, TICK)
        np.testing.assert_allclose(resolution, UNIT * distance**2 / (1 - distance) + 0 * m_s, rtol=1e-9)
        np.testing.assert_allclose(resolution * time, 2 * math.pi / COUNTS / (m_s - 1), rtol=1e-9)
        assert np.all(resolution < UNIT / 2)


def test_resolution_is_the_step_between_neighbouring_velocities() -> None:
    m_s = np.arange(2, 500)
    step = UNIT / (m_s - 1) - UNIT / m_s
    np.testing.assert_allclose(tsuji.tsuji_eq10_resolution(m_s, COUNTS, TICK), step, rtol=1e-9)
    for offset in (-7, 0, 3):
        step = (((m_s - 1) * offset + 1) / (m_s - 1) - (m_s * offset + 1) / m_s) * UNIT
        np.testing.assert_allclose(tsuji.tsuji_eq18_resolution(m_s, COUNTS, TICK), step, rtol=1e-6)


def test_products_of_resolution_and_measurement_time() -> None:
    """In counts, 2π/P: the M method buys resolution with time one to one, the others do better."""
    n = np.arange(1, 100)
    m_s = np.arange(2, 1000)
    count = 2 * math.pi / COUNTS

    averaged = tsuji.tsuji_eq07_resolution(n, COUNTS, TICK) * tsuji.tsuji_eq08_measurement_time(n, TICK)
    t = tsuji.tsuji_eq10_resolution(m_s, COUNTS, TICK) * tsuji.tsuji_eq11_measurement_time(m_s, TICK)
    assert averaged.tolist() == pytest.approx([count] * len(n))
    np.testing.assert_allclose(t, count / (m_s - 1))

    counts = np.arange(1, 50)[:, np.newaxis]
    mt = tsuji.tsuji_eq14_resolution(counts, m_s, 4, COUNTS, TICK) * tsuji.tsuji_eq15_measurement_time(m_s, TICK)
    np.testing.assert_allclose(mt, count * np.minimum(counts / (m_s - 1), m_s / 4))


def test_arguments_are_broadcast_and_ranges_kept() -> None:
    counts, ticks, m_s = np.array([500, 2000]), np.array([[1e-3], [2e-5], [1e-6]]), np.full((4, 1, 1), 3)
    assert tsuji.tsuji_eq18_resolution(m_s, counts, ticks).shape == (4, 3, 2)
    assert tsuji.tsuji_eq14_resolution(5, m_s, 2, counts, ticks).shape == (4, 3, 2)
    assert tsuji.tsuji_eq10_resolution(1, COUNTS, TICK) == math.inf
    assert tsuji.tsuji_eq14_resolution(3, 1, 1, COUNTS, TICK) == pytest.approx(UNIT)
    assert tsuji.tsuji_eq12_interval([0, -UNIT / 8], COUNTS, TICK).tolist() == pytest.approx([math.inf, 8])
    assert tsuji.tsuji_eq16_interval([0, -UNIT / 8], 4, COUNTS, TICK).tolist() == pytest.approx([math.inf, 8])
    for call in (
        lambda: tsuji.unit_velocity(0, TICK),
        lambda: tsuji.tsuji_eq08_measurement_time(4, -TICK),
        lambda: tsuji.tsuji_eq07_resolution([4, 0], COUNTS, TICK),
        lambda: tsuji.tsuji_eq14_resolution(0, 5, 4, COUNTS, TICK),
        lambda: tsuji.tsuji_eq14_resolution(1, 5, 0, COUNTS, TICK),
        lambda: tsuji.tsuji_eq16_interval(UNIT, 0, COUNTS, TICK),
        lambda: tsuji.tsuji_eq18_resolution(math.nan, COUNTS, TICK),
        lambda: tsuji.tsuji_eq19_measurement_time(0.5, TICK),
    ):
        with pytest.raises(ValueError, match="must be"):
            call()


SPEC = STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), frac_bits=20)
SECONDS = float(SPEC.timing.tick_seconds)


def measure(
    units: float, n_ticks: int, spec: STachometer = SPEC, jitter: float = 0.0
) -> tuple[Table, NDArray[np.float64], NDArray[np.int64]]:
    """Run a constant speed, given in unit velocities: updates, their velocities in the same unit, pulse numbers."""
    speed = units * spec.scale.unit_velocity
    encoder = VirtualEncoder(spec.encoder.pulses_per_rev, jitter=jitter, start_angle_rad=0.001, seed=1)
    encoding = encoder.record(parse_motion(f"constant:{speed!r}rad/s:{n_ticks * SECONDS!r}s"))
    run = golden.run(spec, encoding.recording.place(spec.timing.clock_hz))
    return run.updates, run.updates.velocity / 2.0**spec.velocity.frac_bits, run.ticks.pulse_count


@pytest.mark.parametrize(("units", "allowed"), [(1.0003, 0.002), (3.001, 0.002), (1.01, 0.015), (3.01, 0.015)])
def test_disordered_alterations_near_multiples_are_cancelled(units: float, allowed: float) -> None:
    n_ticks = 40_000
    updates, velocity, _ = measure(units, n_ticks, jitter=0.05)
    clocks = np.arange(2 * SPEC.timing.max_ticks, n_ticks) * SPEC.timing.tick_cycles
    held = velocity[np.searchsorted(updates.clock, clocks, side="right") - 1]
    assert np.sqrt(np.mean((held - units) ** 2)) <= allowed


def test_equations_against_their_printed_form() -> None:
    counts, tick = 500, 1e-3
    unit = tsuji.unit_velocity(counts, tick)
    assert unit == pytest.approx(12.566, abs=1e-3)
    assert tsuji.tsuji_eq18_resolution([1, 2, 5], counts, tick).tolist() == pytest.approx(
        [math.inf, 2 * math.pi / (2 * counts * tick), 2 * math.pi / (20 * counts * tick)]
    )
    assert tsuji.tsuji_eq19_measurement_time(5, tick) == pytest.approx(5e-3)
    assert tsuji.tsuji_eq20_interval(unit * np.array([0.25, 3.25, 2.9, 2.0]), counts, tick).tolist() == pytest.approx(
        [4, 4, 10, math.inf]
    )


CLOCK, CYCLES = 10_000_000, 1000


def test_a_long_memory_is_a_least_squares_line_whose_older_events_fade() -> None:
    for x in (1 / 128, 1 / 4096):
        deviation, greatest = tracking.velocity_errors(x)
        assert 0.87 < deviation / (math.sqrt(12) * x**1.5) < 0.88
        assert 2.95 < greatest / x < 3


@pytest.mark.parametrize(("speed", "memory_ms", "jitter"), [(100, 20, 0.2), (20, 50, 0.1), (600, 20, 0.2)])
def test_noise_of_edges_becomes_the_noise_of_the_velocity(speed: float, memory_ms: int, jitter: float) -> None:
    spec = TrackTachometer(
        encoder=Encoder(500), timing=Timing(CLOCK, CYCLES, 100), frac_bits=20, max_memory=memory_ms * CLOCK // 1000
    )
    recording = VirtualEncoder(500, jitter=jitter, seed=1).record(parse_motion(f"constant:{speed}rad/s:2s")).recording
    run = golden.run(spec, recording.place(CLOCK))
    error = run.updates.velocity[5000:] * spec.velocity.rad_per_s_per_lsb - speed
    expected, _ = tracking.errors(np.array([speed]), jitter, 2000, CYCLES / CLOCK, memory_ms / 1000)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(expected[0], rel=0.3)
