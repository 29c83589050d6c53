"""Words of the papers about the S method are measured on the golden model with the virtual encoder."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.run import Table
from tachometry.sim.theory import tsuji
from tachometry.spec import Encoder, STachometer, Timing

SPEC = STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), frac_bits=20)
TICK = float(SPEC.timing.tick_seconds)
HALF_LSB = 2.0 ** -(SPEC.velocity.frac_bits + 1)


def measure(
    units: float, n_ticks: int, spec: STachometer = SPEC, jitter: float = 0.0
) -> tuple[Table, NDArray[np.float64], NDArray[np.int64]]:
    """Run a constant speed, given in unit velocities: updates, their velocities in the same unit, pulse numbers."""
    speed = units * spec.scale.unit_velocity
    encoder = VirtualEncoder(spec.encoder.pulses_per_rev, jitter=jitter, start_angle_rad=0.001, seed=1)
    encoding = encoder.record(parse_motion(f"constant:{speed!r}rad/s:{n_ticks * TICK!r}s"))
    run = golden.run(spec, encoding.recording.place(spec.timing.clock_hz))
    return run.updates, run.updates.velocity / 2.0**spec.velocity.frac_bits, run.ticks.pulse_count


def speeds_over_four_decades() -> list[float]:
    """Return unit velocities from 1/100 to 100, none of them special, some close to multiples and halves."""
    rng = np.random.default_rng(20)
    near = [k + d for k in (1, 2, 7, 30) for d in (-0.0021, 0.0023, 0.01, -0.04, 0.45, 0.52)]
    return [*(10 ** rng.uniform(-2, 2, size=25)).tolist(), *near]


@pytest.mark.parametrize("cancel", only([True], [True, False]))  # eq. (21), which is the default
def test_interval_and_error_at_constant_speed(cancel: bool) -> None:
    far = 0
    spec = STachometer(encoder=SPEC.encoder, timing=SPEC.timing, frac_bits=SPEC.velocity.frac_bits, cancel=cancel)
    for units in speeds_over_four_decades():
        updates, velocity, m_e = measure(units, 8000, spec)
        # The offset is known once a pulse number has come twice; then the second window counts.
        settled = int(np.flatnonzero(m_e[1:] == m_e[:-1])[0]) + 2
        first = int(np.searchsorted(updates.clock, (settled + 1) * spec.timing.tick_cycles)) + 2
        m_s, error = updates.interval[first:], np.abs(velocity[first:] - units)
        if abs(units - round(units)) > 1 / spec.timing.max_ticks:
            far += 1
            wanted = tsuji.tsuji_eq20_interval(units * spec.scale.unit_velocity, spec.encoder.counts_per_rev, TICK)
            assert not updates.forced[first:].any(), units
            assert abs(m_s.mean() - wanted) <= 1 / len(m_s) + 1e-9, units
            bound = tsuji.tsuji_eq18_resolution(m_s, spec.encoder.counts_per_rev, TICK) / spec.scale.unit_velocity
        else:
            bound = 1 / m_s
        assert np.all(error <= bound + HALF_LSB), units
    assert far > 30


@pytest.mark.parametrize("units", [1 / 501, 1.0003, 3.001])
def test_no_spike_where_updates_are_forced(units: float) -> None:
    updates, velocity, _ = measure(units, 40_000)
    settled = updates.clock > 2 * SPEC.timing.max_ticks * SPEC.timing.tick_cycles
    assert np.count_nonzero(updates.forced[settled]) > 5
    assert np.count_nonzero(~updates.forced[settled]) > 5
    assert np.all(np.abs(velocity[settled] - units) <= 1 / SPEC.timing.max_ticks)


@pytest.mark.parametrize(("units", "allowed"), [(1.0003, 0.002), (3.001, 0.002), (1.01, 0.015), (3.01, 0.015)])
def test_disordered_alterations_near_multiples_are_cancelled(units: float, allowed: float) -> None:
    n_ticks = 40_000
    updates, velocity, _ = measure(units, n_ticks, jitter=0.05)
    clocks = np.arange(2 * SPEC.timing.max_ticks, n_ticks) * SPEC.timing.tick_cycles
    held = velocity[np.searchsorted(updates.clock, clocks, side="right") - 1]
    assert np.sqrt(np.mean((held - units) ** 2)) <= allowed


def test_standstill_reads_zero_in_one_and_a_half_times_the_maximum() -> None:
    moving, rest = 1000, 1500
    speed = 1.37 * SPEC.scale.unit_velocity
    motion = parse_motion(f"constant:{speed!r}rad/s:{moving * TICK!r}s+stop:{rest * TICK!r}s")
    trace = VirtualEncoder(500).record(motion).recording.place(SPEC.timing.clock_hz)
    updates = golden.run(SPEC, trace).updates
    late = updates.clock > (moving + 1.5 * SPEC.timing.max_ticks + 2) * SPEC.timing.tick_cycles
    assert late.any()
    assert np.all(updates.velocity[late] == 0)


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
