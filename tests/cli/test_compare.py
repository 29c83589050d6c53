"""`tachometry compare`."""

import csv
from pathlib import Path

import pytest

from tachometry.cli.main import main
from tachometry.sim.compare import RIVALS
from tachometry.spec import METHODS

CORE = "--ppr 100 --clock 1MHz --tick 1ms --max-time 20ms".split()
MOTION = ["--motion", "ramp:0:40rad/s:200ms+sine:30:10Hz:200ms"]


def run(*args: str | Path) -> int:
    with pytest.raises(SystemExit) as stop:
        main([str(arg) for arg in args])
    assert isinstance(stop.value.code, int)
    return stop.value.code


def test_all_methods_in_one_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--csv", tmp_path / "c.csv", "--plot", tmp_path / "c.png"]
    assert run("compare", *CORE, *MOTION, *files) == 0
    told = capsys.readouterr().out.splitlines()
    names = [line.split()[0] for line in told[1 : 1 + len(METHODS) + len(RIVALS)]]
    assert names == [*METHODS, *RIVALS]
    with (tmp_path / "c.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == names
    assert all(0 < float(row["rms"]) < float(row["max"]) for row in rows)
    assert (tmp_path / "c.png").read_bytes().startswith(b"\x89PNG")


def test_options_of_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("compare", *CORE, *MOTION, "--methods", "s, s:cancel=no,m:average=10") == 0
    names = [line.split()[0] for line in capsys.readouterr().out.splitlines()[1:4]]
    assert names == ["s", "s:cancel=no", "m:average=10"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--methods", "x"], "--methods must be of s, m, "),
        (["--methods", ""], "or all, not ''"),
        (["--methods", "s:foo=1"], "options of method s must be of cancel, not 'foo'"),
        (["--methods", "m:average=q"], "average of method m must be a value of its kind: 'q' is not a valid integer."),
        (["--methods", "m:average=900"], "--average must be from 1 to 256, not 900"),
        (["--motion", "stop:1us"], "--motion must last at least two control periods of difference, not 1e-06 s"),
        (["--motion", "stop:1500us", "--methods", "s"], "--motion must last until every method has a value"),
        (["--plot", "x.jpg"], "file must end in .png or .pdf"),
    ],
)
def test_what_cannot_be_is_told_in_one_line(
    options: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run("compare", *CORE, *MOTION, "--csv", tmp_path / "new" / "c.csv", *options) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("tachometry: error: ")
    assert captured.err.count("\n") == 1
    assert message in captured.err
    assert not list(tmp_path.iterdir())
