"""The best setting, and what settings cost, on curves whose answer is known."""

from pathlib import Path

import numpy as np
import pytest

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.plots.tradeoff import save_tradeoff
from tachometry.sim.studies.comparing.baselines import Estimate
from tachometry.sim.studies.comparing.compare import Curve, Judge
from tachometry.sim.studies.comparing.tune import (
    CORES,
    SETTLED_S,
    Cost,
    best,
    core_settings,
    cost,
    equivalent_delay,
    front,
    possible,
    triangle,
)
from tachometry.spec import METHODS, Encoder, STachometer, Timing, of_texts

INSTANTS = np.arange(0.1, 0.4, 1e-4)
JUDGE = Judge(lambda t: np.full(len(t), 5.0), 0.1, 0.4)


def curve(name: str, time: np.ndarray, velocity: np.ndarray) -> Curve:
    return Curve(name, "a curve", Estimate(time, velocity), np.empty(0), INSTANTS)


def constant(name: str, velocity: float, begin: float = 0.0) -> Curve:
    return curve(name, np.array([begin]), np.array([velocity]))


def test_the_best_has_the_least_error() -> None:
    curves = [constant("a", 7), constant("b", 4.5), constant("c", 5.7)]
    assert best(curves, JUDGE).name == "b"
    assert best(iter(curves[::2]), JUDGE).name == "c"


def test_a_setting_is_judged_from_its_first_value_on() -> None:
    assert best([constant("a", 5.2), constant("late", 5.1, begin=0.3)], JUDGE).name == "late"
    never, too_late = curve("never", np.empty(0), np.empty(0)), constant("too late", 5, begin=0.5)
    assert best([never, too_late, constant("a", 9)], JUDGE).name == "a"
    with pytest.raises(ValueError, match=r"^motion must last until a setting of every method has a value$"):
        best([never, too_late], JUDGE)


def test_settings_that_cannot_be_are_left_out() -> None:
    def refuse() -> Curve:
        raise ValueError("period must be shorter")

    assert [one.name for one in possible([refuse, lambda: constant("a", 1), refuse])] == ["a"]
    with pytest.raises(ValueError, match=r"^period must be shorter$"):
        list(possible([refuse]))
    with pytest.raises(ValueError, match=r"^methods must have settings$"):
        list(possible([]))


@pytest.mark.parametrize("delay", [0.3e-3, 2e-3])
def test_the_equivalent_delay_of_a_late_curve_is_its_delay(delay: float) -> None:
    motion = parse_motion(triangle(80))
    time = np.arange(0, motion.duration, 1e-5)
    late = curve("late", time, motion.speed(np.maximum(time - delay, 0)))
    moving = Judge(motion.speed, SETTLED_S + 0.01, 0.39)
    assert np.min(motion.speed(moving.among(INSTANTS))) == pytest.approx(40, abs=0.1)
    assert np.max(motion.speed(moving.among(INSTANTS))) == pytest.approx(80, abs=0.1)
    assert equivalent_delay(late, moving) == pytest.approx(delay, rel=0.05)
    found = cost("method", constant("still", 5.25), late, JUDGE, moving)
    assert found is not None
    assert (found.method, found.name) == ("method", "still")
    assert found.rms == pytest.approx(0.25)
    assert cost("m", constant("still", 5, begin=1), late, JUDGE, moving) is None


def test_the_front_has_what_nothing_is_better_than() -> None:
    at = {"a": (1.0, 5.0), "b": (2.0, 6.0), "c": (2.0, 3.0), "d": (4.0, 3.0), "e": (5.0, 1.0), "f": (1.0, 5.5)}
    costs = [Cost("m", name, rms, delay) for name, (delay, rms) in at.items()]
    assert [one.name for one in front(costs)] == ["a", "c", "e"]
    assert front([]) == []


def test_settings_of_cores() -> None:
    assert core_settings("s") == [("s", {})]
    assert ("mt:min-time=1ms", {"min-time": "1ms"}) in core_settings("mt")
    core = {"ppr": "500", "clock": "10MHz", "tick": "100us", "max-time": "10ms"}
    for method in CORES.keys() & METHODS.keys():
        specs = [of_texts(method, core | options) for _, options in core_settings(method)]
        assert len(set(specs)) == len(specs) > 5


def test_equal_figures_are_equal_files(tmp_path: Path) -> None:
    spec = STachometer(encoder=Encoder(500), timing=Timing.parse("1MHz", "100us", "10ms"))
    costs = {name: [Cost(name, name, 2.0, 1e-3), Cost(name, name, 1.0, 4e-3)] for name in ("mt", "kalman")}
    for path in (tmp_path / "1.png", tmp_path / "2.png", tmp_path / "3.pdf"):
        save_tradeoff(path, spec, costs, 70.0)
    assert (tmp_path / "1.png").read_bytes() == (tmp_path / "2.png").read_bytes()
    assert (tmp_path / "3.pdf").stat().st_size > 1000
