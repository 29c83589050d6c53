"""`tachometry loop`."""

import csv
from pathlib import Path
from typing import Any

import pytest
from support import command

from tachometry.sim import build
from tachometry.sim.engines.loop import COLUMNS
from tachometry.sim.studies.sweeping import cluster

CORE = "--methods s --ppr 500 --clock 48MHz --tick 20us --max-time 10ms".split()
SHORT = [*CORE, "--motion", "ramp:0:4rad/s:30ms+constant:4rad/s:50ms", "--from", "40ms"]


def run(*args: object) -> int:
    return command.run("loop", *args)


def test_one_loop_and_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for folder in ("one", "two"):
        files = ["--log", tmp_path / folder / "log.csv", "--csv", tmp_path / folder / "all.csv"]
        files += ["--plot", tmp_path / folder / "loop.png"]
        assert run(*SHORT, "--load", "20mNm:60ms:10ms", "--kv", "20", "--seeds", "2", "--seed", "7", *files) == 0
    out = capsys.readouterr().out
    assert (
        ("is at its limit" in out) == ("raise --current-limit" in out) == (float(out.split("%")[-2].split()[-1]) > 10)
    )
    table = out.splitlines()
    assert table[0].split()[:4] == ["seed", "RMS", "error", "(rad/s)"]
    assert [line.split()[0] for line in table[1:4]] == ["7", "8", "mean"]
    assert table[5] == "s; ramp:0:4rad/s:30ms+constant:4rad/s:50ms"
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name
    with (tmp_path / "one" / "log.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [name.split()[0] for name in rows[0]] == list(COLUMNS)
    assert len(rows) == 800
    assert float(rows[-1]["speed (rad/s)"]) == pytest.approx(4, abs=1.5)
    with (tmp_path / "one" / "all.csv").open() as file:
        (whole,) = csv.DictReader(file)
    assert whole["method"] == "s"
    assert f"{float(whole['rms_error_rad_s']):.3g}" == table[3].split()[1]


def test_many_loops_and_their_files(
    local: Any, scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = ["--csv", tmp_path / "all.csv", "--plot", tmp_path / "loops.pdf"]
    options = ["--methods", "s", "--vary", "kv=20,80", "--vary", "synchronised=yes,no"]
    assert run(*SHORT, *options, "--seeds", "1", *scheduler, *files) == 0
    assert local.scheduler.transition_counter > 0
    table = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert table[0][:3] == ["method", "kv", "synchronised"]
    assert [row[1:3] for row in table[1:5]] == [[kv, o] for kv in ("20", "80") for o in ("yes", "no")]
    assert " ".join(table[6]).startswith("4 loops with 1 seed each, run in ")
    with (tmp_path / "all.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["kv"] for row in rows] == ["20", "20", "80", "80"]
    assert (tmp_path / "loops.pdf").read_bytes().startswith(b"%PDF")
    # One of them alone, in this process, is the same.
    assert run(*SHORT, "--kv", "80", "--no-synchronised", "--seeds", "1", "--csv", tmp_path / "one.csv") == 0
    with (tmp_path / "one.csv").open() as file:
        (alone,) = csv.DictReader(file)
    assert {name: rows[3][name] for name in alone} == alone


def test_a_loop_alone_may_be_run_elsewhere(
    scheduler: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(*SHORT, "--kv", "80", "--seeds", "1", *scheduler) == 0
    assert "1 loop with 1 seed each, run in " in " ".join(capsys.readouterr().out.split())


def test_all_cores_of_this_machine_run_loops(monkeypatch: pytest.MonkeyPatch) -> None:
    """Processes of their own are those of sweeps, see test_sweep.py; there are as many as wanted."""
    asked = []

    def none(*given: object) -> None:
        asked.append(given)
        raise ValueError("there is none")

    monkeypatch.setattr(cluster, "cluster", none)
    assert run(*SHORT, "--vary", "kv=20,80") == run(*SHORT, "--vary", "kv=20,80", "--jobs", "3") == 2
    assert asked == [(None, None), (None, 3)]


def test_nothing_is_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The files that were there stay, whether there is no compiler or no extra `sweep`."""
    for name in ("log.csv", "all.csv"):
        (tmp_path / name).write_text("old")

    def missing(*_: object) -> None:
        raise OSError("not installed")

    monkeypatch.setattr(cluster, "require", missing)
    assert run(*SHORT, "--vary", "kv=1,2", "--csv", tmp_path / "all.csv") == 2
    monkeypatch.setattr(build, "find_compiler", lambda: None)
    assert run(*SHORT, "--log", tmp_path / "log.csv", "--csv", tmp_path / "all.csv") == 2
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {"log.csv": "old", "all.csv": "old"}
