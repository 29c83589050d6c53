"""The benchmark of control loops: its tables, its figure, and that a gain which is not usable is left out."""

from pathlib import Path
from typing import Any

import pytest
from loops import KINDS, TICKS, Checked
from support.script import load

from tachometry.sim.studies.loops.control import Outcome

bench = load("control")

FINE = Outcome(rms=0.1234, largest=0.2, sound=0.3, limited=0.0, dip=0.4)


def test_a_row_and_a_mark_for_every_gain_that_is_usable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All but those of the conventional observer."""

    def usable(at: Any, seeds: Any, jobs: Any) -> tuple[float, Outcome] | None:
        return None if at(20.0).gains.way.name == "CONVENTIONAL" else (80.0, FINE)

    monkeypatch.setattr(bench, "usable", usable)
    table, found = bench.usable_gains(6, 1)
    _, *rows = table
    n_track = sum(seconds >= 20e-6 for seconds in TICKS)
    fine = "80: 0.123, 0.2, 0.4, 0.3"
    assert len(rows) == 2 * len(KINDS)
    assert ["real disc", "S, synchronised", *[fine] * len(TICKS)] in rows
    assert ["ideal disc", "S, conventional", *"-" * len(TICKS)] in rows
    assert len(found) == 2 * (2 * len(TICKS) + n_track)
    monkeypatch.setattr(bench, "PICTURE", tmp_path / "control.png")
    assert bench.gains(6, 1) == table
    assert bench.PICTURE.read_bytes().startswith(b"\x89PNG")


def test_mismatches_of_all_seeds_are_added(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "check", lambda one, seed: Checked(1000, seed, FINE, FINE))
    rows = bench.in_gates(6, 1)[1:]
    assert len(rows) == 4
    for row in rows:
        assert [*row[1:]] == ["6000", "15", "0.1234", "0.1234", "0.3", "0.3"]
