"""`tachometry plan` of all methods, one by one and beside each other."""

import csv
import math
import re
from pathlib import Path

import pytest
from support import command
from support.nightly import only

from tachometry.spec import METHODS

OPTIONS = "--ppr 500 --clock 48MHz --tick 20us --max-time 10ms --max-speed 400rad/s".split()
UNIT = 50 * math.pi


def run(*args: object) -> int:
    return command.run("plan", *OPTIONS, *args)


# The plans of the others are held against golden models in tests/sim/studies/test_plan_methods.py.
@pytest.mark.parametrize("method", only(["s", "t", "rairan"], METHODS))
def test_every_method_has_a_plan(method: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--method", method, "--plot", tmp_path / "p.png", "--csv", tmp_path / "p.csv") == 0
    told = capsys.readouterr().out
    assert re.search(rf"^method +{method.upper()}, ", told, re.MULTILINE)
    assert "standstill" in told
    assert (tmp_path / "p.png").stat().st_size > 1000


def test_mean_of_ticks(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--method", "m", "--average", "5") == 0
    first, second, *_ = capsys.readouterr().out.split("\n\n")
    assert "M, eq. (6), mean of 5 ticks" in first
    assert "reads 0 at most 100us (5 ticks) after" in first
    rows = [re.split(r" {2,}", line.strip()) for line in second.splitlines()[1:]]
    assert {(*row[2:5], row[6]) for row in rows} == {("5", "100us", f"{UNIT / 5:.4g}", "tick")}


def test_methods_beside_each_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = "s,m,m:average=8,s:cancel=no"
    files = ["--csv", tmp_path / "p.csv", "--plot", tmp_path / "p.png"]
    assert run("--methods", names, "--speeds", "1:300rad/s", *files) == 0
    blocks = capsys.readouterr().out.split("\n\n")[3:]
    assert [block.splitlines()[0] for block in blocks] == ["Q_V (rad/s)", "Q_V/V (%)", "T_m", "Q_V T_m (rad)"]
    for block in blocks:
        _, heads, *rows = block.splitlines()
        assert heads.split() == ["speed", "(rad/s)", *names.split(",")]
        assert len(rows) == 12
    with (tmp_path / "p.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [
        name for k, name in enumerate(row["method"] for row in table) if not k or table[k - 1]["method"] != name
    ] == (names.split(","))
    for row in table:
        speed, q_v, t_m = (float(row[head]) for head in ("speed_rad_s", "resolution_rad_s", "measurement_time_s"))
        assert float(row["relative_resolution"]) == pytest.approx(q_v / speed)
        assert float(row["product_rad"]) == pytest.approx(q_v * t_m)
        if row["method"] == "m:average=8":
            assert (q_v, t_m) == pytest.approx((UNIT / 8, 160e-6))
    assert (tmp_path / "p.png").read_bytes().startswith(b"\x89PNG")


def test_all_methods(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--methods", "all") == 0
    heads = capsys.readouterr().out.split("\n\n")[3].splitlines()[1]
    assert heads.split() == ["speed", "(rad/s)", *METHODS]


def test_a_name_that_is_no_method(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("--methods", "s,odrive") == 2
    assert "--methods must be of auto, s, m" in capsys.readouterr().err
