"""`tachometry figures`."""

import csv
from pathlib import Path

import pytest
from support import command

from tachometry.sim.figures import FIGURES
from tachometry.sim.figures.lab import Lab
from tachometry.sim.golden.methods import m as m_method
from tachometry.sim.golden.quotient import round_quotient


def run(*args: str | Path) -> int:
    return command.run("figures", *args)


def test_figures_data_and_claims(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--only", "tsuji6,rairan2", "-o", tmp_path / "new" / "folder") == 0
    folder = tmp_path / "new" / "folder"
    names = {f"{name}.{kind}" for name in ("tsuji6", "rairan2") for kind in ("svg", "png", "csv")} | {"claims.csv"}
    assert {path.name for path in folder.iterdir()} == names
    assert (folder / "tsuji6.png").read_bytes().startswith(b"\x89PNG")
    told = capsys.readouterr().out
    assert "Tsuji 2009, Fig. 6   yes" in told
    assert "in 2 of 3 claims" in told
    assert "rairan2: the paper says: the time between updates" in told
    assert "1 of 2 figures agree" in told

    with (folder / "tsuji6.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["panel", "curve", "speed (rad/s)", "y"]
    assert {row["panel"] for row in rows} == {"T_m (ms)"}
    slowest = next(row for row in rows if row["curve"] == "S")
    assert float(slowest["y"]) == 10
    with (folder / "claims.csv").open(encoding="utf-8") as file:
        claims = list(csv.DictReader(file))
    assert [claim["figure"] for claim in claims] == ["tsuji6"] * 3 + ["rairan2"] * 3
    assert [claim["agrees"] for claim in claims] == ["yes"] * 5 + ["no"]


def test_equal_options_give_equal_files(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        assert run("--only", "tsuji9", "-o", tmp_path / folder) == 0
    for path in (tmp_path / "one").iterdir():
        assert path.read_bytes() == (tmp_path / "two" / path.name).read_bytes(), path.name


def test_a_mismatch_of_the_hardware_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A golden model with a fault, on a short run: the hardware differs, and the exit status is 1."""
    turn = Lab.turn
    monkeypatch.setattr(Lab, "turn", lambda lab, spec, motion, **more: turn(lab, spec, "ramp:0:40rad/s:400ms", **more))
    true_quotient = round_quotient
    monkeypatch.setattr(m_method, "round_quotient", lambda *args: true_quotient(*args) + 1)
    assert run("--only", "tsuji12", "-o", tmp_path) == 1
    told = capsys.readouterr().out
    assert "tsuji12: first mismatch in m method: velocity_valid.velocity[0]: expected 1, got 0" in told
    assert " mismatches in " in told


def test_help_names_all_figures(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.run("help", "figures", "--only") == 0
    told = capsys.readouterr().out.replace(",", " ").split()
    assert all(name in told for name in FIGURES)
