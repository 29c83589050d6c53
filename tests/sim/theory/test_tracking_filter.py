"""The linear theory of the tracking method beside the recursion, and what `plan` says beside the golden model."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.theory import tracking_filter
from tachometry.sim.theory.performance import PERFORMANCES
from tachometry.sim.theory.tracking import Phase, Recursion, Tuning
from tachometry.spec import Encoder, Timing, TrackTachometer

GAP = 1e-3  # seconds between counts
REACHES = [0.02, 0.1, 0.3]


def states(x: float, places: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return place, velocity and acceleration of the recursion after each count, in counts and gaps, shape (n, 3)."""
    tuning = Tuning(
        bandwidth=x / GAP,
        least_memory=0.5,
        edge_error=1e9,
        agile=False,
        growing=False,
        clock_seconds=1e-8,
        tick_seconds=GAP,
        max_ticks=100,
        max_count=10**9,
        unit_seconds=GAP,
        lead_seconds=0,
    )
    state, rows = Recursion(tuning, phase=Phase.TRACKS), []
    for place in places.tolist():
        state.place += state.velocity * GAP + state.acceleration * GAP**2 / 2
        state.velocity += state.acceleration * GAP
        state.gap = GAP
        state._correct(place - state.place)
        rows.append((state.place, state.velocity * GAP, state.acceleration * GAP**2))
    return np.array(rows)


@pytest.mark.parametrize("x", REACHES)
def test_three_equal_poles(x: float) -> None:
    # The root of a triple zero is known to the third root of the rounding only.
    assert tracking_filter.poles(x) == pytest.approx(np.full(3, math.exp(-x)), abs=1e-4)


@pytest.mark.parametrize("x", only([*REACHES][:1], REACHES))
def test_noise(x: float) -> None:
    noise = np.random.default_rng(3).standard_normal(400_000)
    measured = states(x, noise)[2000:].std(axis=0)
    assert tracking_filter.noise_gains(x) == pytest.approx(measured, rel=0.05)
    theta = math.exp(-x)
    assert tracking_filter.noise_gains(x)[2] == pytest.approx(math.sqrt(6) * ((1 - theta) / (1 + theta)) ** 2.5)


@pytest.mark.parametrize("x", REACHES)
def test_a_jerk_is_followed_with_these_errors(x: float) -> None:
    time = np.arange(2000.0)
    jerk = 1e-6
    true = jerk * np.array([time**3 / 6, time**2 / 2, time])
    measured = (true.T - states(x, true[0]))[-1]
    assert tracking_filter.jerk_errors(x) * jerk == pytest.approx(measured, rel=1e-3)


def test_a_steady_acceleration_is_followed_without_error() -> None:
    time = np.arange(3000.0)
    assert states(0.1, 1e-3 * time**2 / 2)[-1] == pytest.approx([1e-3 * 2999**2 / 2, 2.999, 1e-3], rel=1e-9)


@pytest.mark.parametrize("x", REACHES)
def test_bandwidth(x: float) -> None:
    w = tracking_filter.bandwidth(x)
    time = np.arange(20_000.0)
    velocity = states(x, np.sin(w * time))[10_000:, 1]
    assert velocity.std() * math.sqrt(2) == pytest.approx(w * math.sqrt(0.5), rel=0.01)


def worst_velocity(x: float, n: int) -> float:
    """Return what n errors of 1 or −1 cause if each has the worse sign."""
    impulse = np.zeros(n)
    impulse[0] = 1
    answer = states(x, impulse)[:, 1]
    return float(states(x, np.sign(answer[::-1]))[-1, 1])


@pytest.mark.parametrize("x", REACHES)
def test_the_worst_noise_is_no_larger_than_said_and_is_reached(x: float) -> None:
    assert worst_velocity(x, 2000) == pytest.approx(tracking_filter.worst_gain(x), rel=1e-4)


def test_the_worst_noise_of_a_long_memory() -> None:
    """It is proportional to x there, so that a low bandwidth takes no longer to plan."""
    assert worst_velocity(0.002, 20_000) == pytest.approx(tracking_filter.worst_gain(0.002), rel=2e-3)
    assert 1e6 * tracking_filter.worst_gain(1e-9) == pytest.approx(tracking_filter.worst_gain(1e-3))


@pytest.mark.parametrize("growing", [True, False])
@pytest.mark.parametrize("speed", [2.0, 20.0, 100.0, 250.0])
def test_plan_bounds_the_error_at_constant_speed(speed: float, growing: bool) -> None:
    spec = TrackTachometer(
        encoder=Encoder(500),
        timing=Timing.parse("10MHz", "100us", "10ms"),
        frac_bits=20,
        growing_memory=growing,
    )
    planned = PERFORMANCES["track"](spec, np.array([speed]))
    trace = VirtualEncoder(500, seed=1).record(parse_motion(f"constant:{speed}rad/s:1.5s"))
    run = golden.run(spec, trace.recording.place(spec.timing.clock_hz))
    error = np.abs(run.updates.velocity * spec.scale.rad_per_s_per_lsb - speed)
    settled = error[len(error) * 2 // 3 :].max()
    lsb = spec.scale.rad_per_s_per_lsb
    assert settled <= planned.resolution[0] + lsb, (settled, planned.resolution[0], lsb)
    assert planned.time[0] >= 1e-3
