"""A disc is learned from its own edges, which has some use."""

from typing import Any

import numpy as np
import pytest

from tachometry.sim import golden
from tachometry.sim.encoder.motion import Vibration, parse_motion
from tachometry.sim.encoder.virtual import Encoding, VirtualEncoder
from tachometry.sim.studies.comparing.encoder_errors import (
    CYCLE,
    Counts,
    by_counts,
    by_tracking,
    learn,
    perfect_offsets,
    rms,
    shifted,
)
from tachometry.sim.theory.tracking import Tuning
from tachometry.spec import Encoder, Timing, TrackTachometer, of_texts

PHASE: dict[str, Any] = {"phase_error_deg": 20, "duty_error_deg": 20}


def recorded(motion: str, lines: int = 500, **faults: Any) -> Encoding:
    return VirtualEncoder(lines, **faults).record(parse_motion(motion))


@pytest.mark.parametrize("direction", ["", "-"])
@pytest.mark.parametrize("start", [0.0, 1.0])
def test_edges_are_those_of_the_disc(direction: str, start: float) -> None:
    """Seen in either direction and from any angle, so that what is learned is where they are."""
    encoding = recorded(f"constant:{direction}50rad/s:200ms", start_angle_rad=start, **PHASE)
    counts = Counts.of(encoding)
    pitch = encoding.encoder.disc.pitch_rad
    angle = encoding.motion.angle(counts.steps.time) + start
    np.testing.assert_allclose(counts.coordinate(encoding.encoder.disc.offset), angle / pitch, atol=1e-6)
    np.testing.assert_allclose(learn(counts).offsets, perfect_offsets(encoding, CYCLE), atol=1e-6)
    assert np.ptp(perfect_offsets(encoding, CYCLE)) > 0.4


def test_lines_are_learned_too() -> None:
    encoding = recorded("constant:100rad/s:1s", 20, nonuniformity=0.1, phase_error_deg=10, seed=3)
    found = learn(Counts.of(encoding), 4 * 20)
    np.testing.assert_allclose(found.offsets, perfect_offsets(encoding, 4 * 20), atol=1e-6)


def test_acceleration() -> None:
    """It takes no part, and neither does a reversal."""
    encoding = recorded("ramp:30rad/s:90rad/s:100ms+ramp:90rad/s:-90rad/s:100ms", **PHASE)
    found = learn(Counts.of(encoding)).history
    error = np.abs(found - perfect_offsets(encoding, CYCLE)).max(axis=1)
    assert len(error) > 3000
    assert error[1000:].max() < 5e-3


def test_jitter_is_averaged() -> None:
    """The slower the rate, the better; and nothing is known before a round is complete."""
    encoding = recorded("constant:100rad/s:300ms", jitter=0.05, **PHASE)
    counts, perfect = Counts.of(encoding), perfect_offsets(encoding, CYCLE)
    errors = [float(np.std(learn(counts, least_rate=rate).history[3000:] - perfect)) for rate in (1 / 8, 1 / 128)]
    assert errors[1] < errors[0] / 2
    assert errors[1] < 0.005
    assert not learn(counts).history[:CYCLE].any()


def test_vibration() -> None:
    """A shaft that never turns a cycle in one direction teaches nothing."""
    counts = Counts.of(recorded("sine:1.2rad/s:50Hz:100ms", start_angle_rad=1.0, **PHASE))
    assert len(counts.edge) == 20
    assert not learn(counts).history.any()


def test_what_is_slow_teaches_nothing() -> None:
    """A vibration in step with the cycle looks like an error of the disc."""
    vibrates = recorded("constant:2.14rad/s:1s", vibration=Vibration(2e-4, 170.3))
    counts = Counts.of(vibrates)
    assert np.ptp(learn(counts).offsets) > 0.05
    assert not learn(counts, slowest_s=2e-3).history.any()


@pytest.mark.parametrize("option", ["yes", "no"])
def test_without_offsets_it_is_the_golden_model(option: str) -> None:
    """By positions alone it is the M/T of the golden model, but for the clock."""
    encoding = recorded("sine:50rad/s:20Hz:100ms", jitter=0.1)
    texts = {"ppr": "500", "clock": "100MHz", "tick": "100us", "min-time": "300us", "bound-decay": "no"}
    spec = of_texts("mt", texts | {"whole-cycles": option})
    updates = golden.run(spec, encoding.recording.place(spec.timing.clock_hz)).updates
    counts = Counts.of(encoding)
    found = by_counts(counts, counts.coordinate(np.zeros(1)), 300e-6, option == "yes")
    assert len(found.velocity) == len(updates.clock) > 100
    np.testing.assert_allclose(found.velocity, updates.velocity * spec.scale.rad_per_s_per_lsb, atol=0.02)


def test_offsets_take_phase_and_duty_errors_out() -> None:
    encoding = recorded("constant:20rad/s:300ms", **PHASE)
    counts, instants = Counts.of(encoding), np.arange(0.1, 0.3, 1e-4)
    truth = encoding.true_speed(instants)
    without, with_them = (
        rms(by_counts(counts, place, 1e-4), truth, instants)
        for place in (counts.coordinate(np.zeros(1)), learn(counts).coordinate(counts))
    )
    assert without > 1
    assert with_them < 1e-3


TRACK = TrackTachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, 500))


def test_tracking() -> None:
    """By positions alone it is the golden model, but for the clock and the words; offsets take a phase error out."""
    encoding = recorded("sine:50rad/s:5Hz:200ms", **PHASE)
    updates = golden.run(TRACK, encoding.recording.place(TRACK.timing.clock_hz)).updates
    counts, tuning = Counts.of(encoding), Tuning.of(TRACK)
    without = by_tracking(counts, counts.coordinate(np.zeros(1)), tuning)
    instants = np.arange(0.05, 0.2, 1e-4)
    seen = updates.velocity[np.searchsorted(updates.clock, instants * TRACK.timing.clock_hz, side="right") - 1]
    assert np.sqrt(np.mean(np.square(without.at(instants) - seen * TRACK.scale.rad_per_s_per_lsb))) < 0.05
    truth = encoding.true_speed(instants)
    known = by_tracking(counts, counts.coordinate(perfect_offsets(encoding, CYCLE)), tuning)
    assert rms(known, truth, instants) < 0.8 * rms(without, truth, instants)
    slow = recorded("constant:1.3rad/s:4s", **PHASE)
    counts, instants = Counts.of(slow), np.arange(2, 4, 1e-3)
    truth = slow.true_speed(instants)
    known = by_tracking(counts, counts.coordinate(perfect_offsets(slow, CYCLE)), tuning)
    assert rms(known, truth, instants) < 1e-3
    assert rms(by_tracking(counts, counts.coordinate(np.zeros(1)), tuning), truth, instants) > 0.1


def test_hysteresis_that_is_alike_is_not_learned() -> None:
    """All edges come later in either direction; where those of A come later than those of B, a sign depends on it."""
    counts = Counts.of(recorded("constant:50rad/s:100ms+constant:-50rad/s:100ms"))
    alike = shifted(counts, [0.1], [-0.1])
    assert np.abs(learn(alike).history).max() < 1e-3
    lines = shifted(counts, [0.05, 0.15], [-0.05, -0.15])
    half = int(np.argmin(counts.steps.step))
    found = learn(lines).history
    assert found[half - 10] == pytest.approx([-0.05, 0.05] * 2, abs=1e-3)
    assert found[-1] == pytest.approx([0.05, -0.05] * 2, abs=5e-3)
