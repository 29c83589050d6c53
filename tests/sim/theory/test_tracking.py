"""The linear theory of the tracking method beside the golden model."""

import math

import numpy as np
import pytest

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.theory import tracking
from tachometry.spec import Encoder, Timing, TrackTachometer

CLOCK, TICK = 10_000_000, 1000


def test_a_long_memory_is_a_least_squares_line_whose_older_events_fade() -> None:
    for x in (1 / 128, 1 / 4096):
        deviation, greatest = tracking.velocity_errors(x)
        assert 0.87 < deviation / (math.sqrt(12) * x**1.5) < 0.88
        assert 2.95 < greatest / x < 3


@pytest.mark.parametrize(("speed", "memory_ms", "jitter"), [(100, 20, 0.2), (20, 50, 0.1), (600, 20, 0.2)])
def test_noise_of_edges_becomes_the_noise_of_the_velocity(speed: float, memory_ms: int, jitter: float) -> None:
    spec = TrackTachometer(
        encoder=Encoder(500), timing=Timing(CLOCK, TICK, 100), frac_bits=20, max_memory=memory_ms * CLOCK // 1000
    )
    recording = VirtualEncoder(500, jitter=jitter, seed=1).record(parse_motion(f"constant:{speed}rad/s:2s")).recording
    run = golden.run(spec, recording.place(CLOCK))
    error = run.updates.velocity[5000:] * spec.velocity.rad_per_s_per_lsb - speed
    expected, _ = tracking.errors(np.array([speed]), jitter, 2000, TICK / CLOCK, memory_ms / 1000)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(expected[0], rel=0.3)
