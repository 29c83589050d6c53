"""Filters on positions that are read: against what their papers define, and in the command that compares them."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.command import run

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import SampledEncoder
from tachometry.sim.studies.comparing.baseline_catalogue import OF_READS, steps_curve
from tachometry.sim.studies.comparing.baselines import Steps
from tachometry.sim.studies.comparing.comparison import steps_beside
from tachometry.sim.studies.comparing.read_filters import savitzky_golay
from tachometry.spec import of_texts

TICK, COUNTS = 1e-4, 1 << 17


def positions(of: object, n: int = 4000, age: float = 0.25) -> Steps:
    """Return positions of a polynomial of the time in seconds, counts, without rounding."""
    time = np.linspace(TICK, n * TICK, n)
    none = np.empty(0, np.int64)
    place = np.polyval(of, time - age * TICK)  # type: ignore[call-overload]
    return Steps(np.empty(0), none, 1.0, COUNTS, time, taken=place - place[0], age_s=age * TICK, tick_s=TICK)


@pytest.mark.parametrize(
    ("name", "of"), [("savitzky-golay:reads=9:order=3", [5e4, 3e4, -2e4, 7]), ("pll", [9e4, 3]), ("pll", [50.0, 0])]
)
def test_a_speed_that_a_filter_can_follow_is_exact(name: str, of: list[float]) -> None:
    steps = positions(of)
    found = steps_curve(name, steps).estimate.velocity / steps.count_rad
    np.testing.assert_allclose(found[-500:], np.polyval(np.polyder(of), steps.reads[-500:]), rtol=1e-9, atol=1e-3)


@pytest.mark.parametrize("name", OF_READS)
def test_the_speed_of_a_ramp_lags_without_an_acceleration_alone(name: str) -> None:
    steps = positions([1e6, 2e4, 0], 9000)
    error = steps_curve(name, steps).estimate.velocity[-1] / steps.count_rad - (2e6 * steps.reads[-1] + 2e4)
    assert (abs(error) < 1) == (name in ("alpha-beta-gamma", "savitzky-golay")), error


def test_a_polynomial_is_that_of_numpy() -> None:
    steps = positions([0.0])
    steps = replace(steps, taken=np.random.default_rng(1).integers(0, 100, 4000))
    assert steps.taken is not None
    found = savitzky_golay(steps, 13, 2).velocity[1000] / steps.count_rad
    fit = np.polyfit(steps.reads[988:1001], steps.taken[988:1001], 2)
    assert found == pytest.approx(np.polyval(np.polyder(fit), steps.reads[1000] + steps.age_s))


def test_reads_begin_at_place_zero() -> None:
    spec = of_texts("m", {"sensor": "ssi", "bits": "0+12", "clock": "10MHz", "tick": "100us", "max-time": "10ms"})
    shaft = SampledEncoder.of(spec.encoder, core=spec, start_angle_rad=1.0)
    taken: Any = steps_beside(spec, shaft.record(parse_motion("constant:30rad/s:2ms")).recording).taken
    np.testing.assert_allclose(taken, np.arange(19) * 30 * TICK / (2 * np.pi) * 4096, atol=2)


def test_methods_on_reads_are_compared(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    core = "--sensor ssi --bits 3+12 --reverse --clock 50MHz --tick 200us --max-time 100ms --max-speed 400rad/s"
    words = [*core.split(), "--motion", "constant:30rad/s:300ms", "--from", "250ms", "--csv", tmp_path / "c.csv"]
    assert run("compare", *words) == 0
    with (tmp_path / "c.csv").open() as file:
        errors = {row["name"]: float(row["rms_rad_s"]) for row in csv.DictReader(file)}
    assert [*errors] == ["m", "track", *OF_READS]
    assert errors["track"] < 0.02
    assert max(errors.values()) < 8
    capsys.readouterr()
    for more, why in (
        (["--methods", "odrive"], "--methods must be of auto, s, m, t, mt, rairan, track, alpha-beta, "),
        (["--methods", "savitzky-golay:reads=2"], "number of reads must be more than the order, 2, and at most 10000"),
    ):
        assert run("compare", *words, *more) == 2
        assert why in capsys.readouterr().err
    assert run("compare", *core.split(), "--replay", tmp_path / "c.csv") == 2
    assert "--replay must be of edges, not with --sensor ssi: give --motion" in capsys.readouterr().err
