"""The benchmark of control loops: its tables, its figure, and that a gain which is not usable is left out."""

from pathlib import Path
from typing import Any

import pytest
from gate_check import Checked
from support.script import load
from usable_gain import KINDS, TICKS

from tachometry.sim.studies.loops.control import Outcome

bench = load("control")

FINE = Outcome(rms=0.1234, largest=0.2, sound=0.3, limited=0.0, dip=0.4)


def test_a_row_and_a_mark_for_every_gain_that_is_usable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All but those of the conventional observer."""

    def usable(at: Any, seeds: Any, jobs: Any) -> tuple[float, Outcome] | None:
        return None if at(20.0).gains.way.name == "CONVENTIONAL" else (80.0, FINE)

    monkeypatch.setattr(bench, "usable", usable)
    table, found = bench.usable_gains(range(6), 1)
    rows = table.splitlines()[2:]
    n_track = sum(seconds >= 20e-6 for seconds in TICKS)
    fine = "80: 0.123, 0.2, 0.4, 0.3"
    assert len(rows) == 2 * len(KINDS)
    assert f"| real disc | S, synchronised | {' | '.join([fine] * len(TICKS))} |" in rows
    assert f"| ideal disc | S, conventional | {' | '.join('-' * len(TICKS))} |" in rows
    assert len(found) == 2 * (2 * len(TICKS) + n_track)
    for name in ("one.png", "two.png"):
        bench.save_usable_gains(tmp_path / name, found)
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "two.png").read_bytes()


def test_mismatches_of_all_seeds_are_added(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "check", lambda one, seed: Checked(1000, seed, FINE, FINE))
    rows = bench.in_gates(range(6), 1).splitlines()[2:]
    assert len(rows) == 4
    for line in rows:
        assert line.split(" | ")[1:] == ["6000", "15", "0.1234", "0.1234", "0.3", "0.3 |"]


def test_an_observer_of_the_acceleration_has_the_same_gains(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def outcome(one: Any, seeds: Any, jobs: Any) -> Outcome:
        asked.append((one.spec.method, one.gains.way.name, one.gains.velocity, one.gains.observer))
        return FINE

    monkeypatch.setattr(bench, "outcome_of", outcome)
    rows = bench.accelerations(range(6), 1).splitlines()[2:]
    assert rows[1] == "| 40 | 80 | acceleration | 0.123, 0.2, 0.4, 0.3 |"
    assert len(rows) == len(asked) == 10
    for velocity, acceleration in zip(asked[::2], asked[1::2], strict=True):
        assert velocity == ("track", "SYNCHRONISED", *acceleration[2:])
        assert acceleration[:2] == ("track", "ACCELERATION")


def test_slow_shafts_are_those_of_three_methods(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = []

    def outcome(one: Any, seeds: Any, jobs: Any) -> Outcome:
        asked.append((one.task.motion.speed(one.task.motion.duration), one.spec.method, one.gains.filter))
        return FINE

    monkeypatch.setattr(bench, "outcome_of", outcome)
    rows = bench.slow_shafts(range(6), 1).splitlines()[2:]
    assert [row.split(" | ")[0] for row in rows] == ["| 0", "| 2 rad/s", "| 10 rad/s"]
    assert [float(speed) for speed, *_ in asked[::4]] == [0, 2, 10]
    assert [method for _, method, _ in asked[:4]] == ["s", "mt", "track", "track"]
    assert [rate for *_, rate in asked[2:4]] == [float("inf"), 226.2]
