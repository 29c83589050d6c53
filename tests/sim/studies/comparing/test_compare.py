"""Methods on the same edges: what is told of each, on curves whose answer is known."""

from pathlib import Path

import numpy as np
import pytest
from support.lines import PPR, record

from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.plots.compare import save_comparison
from tachometry.sim.studies.comparing import baselines
from tachometry.sim.studies.comparing.baseline_catalogue import BASELINES, steps_curve
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.compare import Curve, Judge, begun, core_curve, score
from tachometry.sim.studies.comparing.comparison import Judging, Source, comparison, steps_beside
from tachometry.spec import METHODS, Encoder, Timing, of_texts


def curve(time: np.ndarray, velocity: np.ndarray) -> Curve:
    return Curve("x", "a curve", baselines.Estimate(time, velocity), np.full(len(time), 2e-3), time)


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
    assert (begun(curves), begun(curves, 0.4), begun([])) == (0.3, 0.4, 0)
    reads = np.arange(101.0)
    np.testing.assert_allclose(Judge(None, 30, 90).among(reads), reads[30:91])
    np.testing.assert_allclose(Judge(None, 30, 90, 20.0).among(reads), reads[10:71] + 20)
    many = Judge(None, 0, 1).among(np.linspace(0, 1, 1_000_001))
    assert 100_000 < len(np.unique(many)) <= 200_000


def test_every_method_follows_a_constant_speed(tmp_path: Path) -> None:
    truth = record("constant:70rad/s:400ms")
    timing = Timing(1_000_000, 1000, 20)
    specs = {name: spec(encoder=Encoder(PPR), timing=timing) for name, spec in METHODS.items()}
    trace = truth.recording.place(timing.clock_hz)
    curves = [core_curve(name, spec, trace) for name, spec in specs.items()]
    curves += [steps_curve(name, steps_beside(specs["s"], truth.recording)) for name in BASELINES]
    instants = [Judge(truth.true_speed, 0.2, 0.4).among(each.reads) for each in curves]  # filters have settled
    scores = [score(each, 0.4, at, truth.true_speed) for each, at in zip(curves, instants, strict=True)]
    for each, at in zip(curves, instants, strict=True):
        assert np.mean(each.estimate.at(at)) == pytest.approx(70, rel=0.02), each.name
        assert len(at) == 200, each.name
    pictures = [tmp_path / name for name in ("1.png", "2.png")]
    for path in pictures:
        save_comparison(path, specs["s"], curves, scores, instants, truth.true_speed)
    assert pictures[0].read_bytes() == pictures[1].read_bytes()
    save_comparison(tmp_path / "3.pdf", specs["s"], curves, scores, instants, None)


def test_too_short_for_a_control_period() -> None:
    with pytest.raises(ValueError, match=r"^motion must last at least two control periods of hostmot2, not 1ms$"):
        steps_curve("hostmot2", Steps.of_sensor(record("stop:1ms").recording, Encoder(100)))


# --- when a value is read


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def compared(
    truth: Encoding, methods: list[str], clock: str = "10MHz", read_delay: float = 0.0
) -> dict[str, np.ndarray]:
    """Return the errors of each method in ticks of 100 us, without the first 40 ms."""
    texts = {"ppr": "500", "clock": clock, "tick": "100us", "max-time": "10ms", "max-speed": "400rad/s"}
    specs = {name: None if name in BASELINES else of_texts(name, texts) for name in methods}
    spec, source = of_texts(methods[0], texts), Source("", truth.recording, truth.true_speed)
    found = comparison(spec, specs, lambda *_: spec, source, Judging(0.04, 1.0, read_delay))
    for at, one in zip(found.instants, specs.values(), strict=True):
        late = (one or spec).latency.tick_to_velocity + 1  # float models are read with the first core
        assert len(at) in (1599, 1600)
        np.testing.assert_allclose((at - late / spec.timing.clock_hz - read_delay + 5e-5) % 1e-4, 5e-5, atol=1e-10)
    pairs = zip(found.curves, found.instants, strict=True)
    errors = {curve.name: curve.estimate.at(at) - truth.true_speed(at) for curve, at in pairs}
    assert [one.rms for one in found.scores] == pytest.approx([rms(error) for error in errors.values()])
    return errors


def test_a_faster_clock_does_not_read_worse() -> None:
    truth = record("ramp:0:100rad/s:200ms", pulses_per_rev=500, jitter=0.05, seed=1)
    for method in ("mt", "track"):
        slow, fast = (rms(compared(truth, [method], clock)[method]) for clock in ("10MHz", "100MHz"))
        assert fast == pytest.approx(slow, rel=0.1), method


def test_a_read_delay_makes_all_values_of_a_ramp_older() -> None:
    truth = record("ramp:0:100rad/s:200ms", pulses_per_rev=500)
    methods = ["track", "m", "least-squares", "kf-ca", "hostmot2"]
    at_once, late = (compared(truth, methods, read_delay=delay) for delay in (0.0, 90e-6))
    for name in methods:
        assert np.mean(late[name]) - np.mean(at_once[name]) == pytest.approx(-500 * 90e-6, rel=0.02), name
    assert rms(at_once["track"]) < 0.02 * 500 * 90e-6
