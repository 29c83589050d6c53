"""Words of the papers about the S method are measured on the golden model with the virtual encoder."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.run import Table
from tachometry.sim.theory import tsuji
from tachometry.spec import Encoder, STachometer, Timing

SPEC = STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), frac_bits=20)
TICK = float(SPEC.timing.tick_seconds)


def measure(
    units: float, n_ticks: int, spec: STachometer = SPEC, jitter: float = 0.0
) -> tuple[Table, NDArray[np.float64], NDArray[np.int64]]:
    """Run a constant speed, given in unit velocities: updates, their velocities in the same unit, pulse numbers."""
    speed = units * spec.scale.unit_velocity
    encoder = VirtualEncoder(spec.encoder.pulses_per_rev, jitter=jitter, start_angle_rad=0.001, seed=1)
    encoding = encoder.record(parse_motion(f"constant:{speed!r}rad/s:{n_ticks * TICK!r}s"))
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
