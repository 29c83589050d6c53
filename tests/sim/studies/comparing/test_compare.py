"""Methods on the same edges: what is told of each, on curves whose answer is known."""

from pathlib import Path

import numpy as np
import pytest
from support.lines import PPR, record

from tachometry.sim.plots.compare import save_comparison
from tachometry.sim.studies.comparing import baselines
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.compare import Curve, common_instants, core_curve, score
from tachometry.sim.studies.comparing.rivals import BASELINES, steps_curve
from tachometry.spec import METHODS, Encoder, Timing


def curve(time: np.ndarray, velocity: np.ndarray) -> Curve:
    return Curve("x", "a curve", baselines.Estimate(time, velocity), np.full(len(time), 2e-3))


def test_a_late_curve_has_that_delay_and_no_other_error() -> None:
    time = np.arange(0, 2, 1e-4)
    late = curve(time, np.sin(2 * np.pi * 3 * (time - 5e-3)))
    found = score(late, 2.0, time[100:-100], lambda t: np.sin(2 * np.pi * 3 * t))
    assert found.delay == pytest.approx(5e-3, abs=1e-4)
    assert found.max == pytest.approx(2 * np.sin(2 * np.pi * 3 * 2.5e-3), rel=1e-3)
    assert found.rms == pytest.approx(found.max / np.sqrt(2), rel=1e-2)
    assert found.mean_time == pytest.approx(2e-3)
    assert found.worst_time == 2e-3
    assert found.updates_per_second == len(time) / 2


def test_what_cannot_be_told_is_not() -> None:
    steady = curve(np.arange(0, 1, 1e-3), np.full(1000, 5.0))
    found = score(steady, 1.0, np.arange(0.1, 0.9, 1e-3), lambda t: np.full(len(t), 5.0))
    assert (found.rms, found.max, found.delay) == (0, 0, None)
    assert score(steady, 1.0, np.arange(0.1, 0.9, 1e-3), None).rms is None


def test_there_is_no_delay_where_it_says_nothing() -> None:
    """On a ramp an offset looks like a delay, or like its opposite, and so does noise."""
    time = np.arange(0, 0.4, 1e-4)
    instants = time[100:-100]

    def ramp(t: np.ndarray) -> np.ndarray:
        return 250 * t

    def delay(velocity: np.ndarray) -> float | None:
        return score(curve(time, velocity), 0.4, instants, ramp).delay

    noise = np.random.default_rng(1).normal(0, 9, len(time))
    assert delay(ramp(time - 2e-3)) == pytest.approx(2e-3, abs=1e-4)
    assert delay(ramp(time - 2e-3) + noise / 30) == pytest.approx(2e-3, abs=2e-4)
    assert delay(ramp(time - 2e-3) + noise) is None
    assert delay(ramp(time + 2e-3)) is None  # early


def test_curves_are_compared_from_when_all_have_begun() -> None:
    curves = [curve(np.array([0.1, 0.2]), np.zeros(2)), curve(np.array([0.3]), np.zeros(1))]
    instants = common_instants(curves, 1.0, 0.01)
    assert instants[0] == 0.3
    assert len(instants) == 70
    assert np.all(np.diff(instants) > 0)


def test_every_method_follows_a_constant_speed(tmp_path: Path) -> None:
    truth = record("constant:70rad/s:400ms")
    timing = Timing(1_000_000, 1000, 20)
    specs = {name: spec(encoder=Encoder(PPR), timing=timing) for name, spec in METHODS.items()}
    trace = truth.recording.place(timing.clock_hz)
    curves = [core_curve(name, spec, trace) for name, spec in specs.items()]
    curves += [steps_curve(name, Steps.of_recording(truth.recording, 4 * PPR)) for name in BASELINES]
    instants = common_instants(curves, 0.4, 1e-3)
    instants = instants[instants > 0.2]  # filters have settled
    scores = [score(each, 0.4, instants, truth.true_speed) for each in curves]
    for found in scores:
        mean = np.mean(next(each for each in curves if each.name == found.name).estimate.at(instants))
        assert mean == pytest.approx(70, rel=0.02), found.name
    pictures = [tmp_path / name for name in ("1.png", "2.png")]
    for path in pictures:
        save_comparison(path, specs["s"], curves, scores, instants, truth.true_speed)
    assert pictures[0].read_bytes() == pictures[1].read_bytes()
    save_comparison(tmp_path / "3.pdf", specs["s"], curves, scores, instants, None)


def test_too_short_for_a_control_period() -> None:
    with pytest.raises(ValueError, match=r"^motion must last at least two control periods of hostmot2, not 1ms$"):
        steps_curve("hostmot2", Steps.of_recording(record("stop:1ms").recording, 400))
