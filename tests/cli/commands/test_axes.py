"""Cores of many axes on the command line."""

import csv
import json
import re
import subprocess
from pathlib import Path

import pytest
from support.command import run
from support.compiled import lint
from support.nightly import only

from tachometry.hdl.export import export
from tachometry.sim.studies import verify as study
from tachometry.sim.studies.pairs import AXES, core_of

CORE = "--method s --ppr 25 --clock 20kHz --tick 2ms --max-time 8ms --max-speed 100rad/s --engine pysim".split()
MOTIONS = "ramp:0:60rad/s:100ms,constant:-40rad/s:100ms"


def rows(capsys: pytest.CaptureFixture[str]) -> list[str]:
    return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


def test_simulate_and_replay(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Each axis has its own motion; a saved capture has the channels of all of them."""
    files = {"--trace": "t.csv", "--counts": "c.csv", "--events": "e.csv", "--save-capture": "s.sr", "--vcd": "v.vcd"}
    outputs = [word for option, name in files.items() for word in (option, tmp_path / name)]
    axes = ["--axes", "3", "--index"]
    assert run("simulate", *CORE, *axes, "--motion", MOTIONS, "--jitter", "0.1", *outputs) == 0
    told = rows(capsys)
    assert "axis 0 " in told[3]
    found = [re.match(r"axis (\d) .*counts in (-?\d+), counts out (-?\d+), 0 errors flagged", line) for line in told]
    counts = {match[1]: (match[2], match[3]) for match in found if match}
    assert {axis: out for axis, (_, out) in counts.items()}.keys() == {"0", "1", "2"}
    assert all(abs(int(wanted) - int(out)) <= 1 for wanted, out in counts.values())
    assert int(counts["0"][1]) > 10 > -10 > int(counts["1"][1])
    assert told[-1].startswith("PASS: hardware and golden model agree in every bit of ")
    with (tmp_path / "t.csv").open() as file:
        updates = list(csv.DictReader(file))
    assert {row["axis"] for row in updates} == {"0", "1", "2"}
    assert "turn" in (tmp_path / "v.vcd").read_text()
    # Another order of the axes, other ports.
    for captured in ("s.sr", "v.vcd"):
        assert run("replay", tmp_path / captured, *CORE, *axes, "--parallel") == 0
        again = {line.split()[1]: line for line in rows(capsys) if line.startswith("axis")}
        assert all(f"counts out {counts[axis][1]}," in again[axis] for axis in counts)
    assert run("replay", tmp_path / "s.sr", *CORE, *axes, "--a", "A1,A0") == 2
    assert "--a must be 3 channels with commas between, one for each axis, not 'A1,A0'" in capsys.readouterr().err
    two = ["--axes", "2", "--a", "A1,A0", "--b", "B1,B0"]
    assert run("replay", tmp_path / "s.sr", *CORE, *two) == 0
    other = {line.split()[1]: line for line in rows(capsys) if line.startswith("axis")}
    assert f"counts out {counts['1'][1]}," in other["0"]


def test_axes_without_an_index(capsys: pytest.CaptureFixture[str]) -> None:
    """Of one axis such a core would be run in pieces."""
    assert run("simulate", *CORE[:-2], "--axes", "2", "--motion", "constant:9rad/s:20ms") == 0
    assert [line.split(" updates")[0][:6] for line in rows(capsys) if line.startswith("axis")] == ["axis 0", "axis 1"]


def test_what_the_reader_says_of_an_axis_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = [f"{k / 1000},{k % 2},0,{'X' if k == 7 else 0},{k % 2}" for k in range(20)]
    (tmp_path / "c.csv").write_text("\n".join(["time,a0,b0,a1,b1", *lines, ""]))
    assert run("replay", tmp_path / "c.csv", *CORE, "--axes", "2") == 0
    assert [line for line in rows(capsys) if line.startswith("note axis")] == [
        "note axis 1: 1 cell with an X: the level before holds there"
    ]


def test_edges_that_are_too_close_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    core = "--ppr 25 --clock 2kHz --tick 20ms --max-time 80ms --engine pysim --axes 3".split()
    assert run("simulate", *core, "--motion", "constant:60rad/s:100ms,stop:100ms") == 0
    assert "WARNING: axis 0: " in (told := capsys.readouterr().out)
    assert "came within 4 clocks of another, in which an axis is looked at once" in told.replace("\n", " ")
    assert "WARNING: axis 1" not in told


@pytest.mark.parametrize("more", [[], ["--parallel", "--external-tick", "--filter", "7", "--unit", "rpm"]])
def test_generate(more: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The smoke test beside the Verilog finds each axis where it turned to."""
    core = "--ppr 25 --clock 1MHz --tick 100us --max-time 400us --index".split()
    assert run("generate", *core, "--axes", "3", *more, "--name", "axes", "-o", tmp_path) == 0
    told = rows(capsys)
    assert any(line.startswith("axes 3, each looked at every 4 clocks and computed in ") for line in told)
    manifest = json.loads((tmp_path / "axes.json").read_text())
    assert manifest["parameters"]["axes"] == 3
    late = manifest["latency_cycles"]["tick_latency"]
    assert any(line.startswith(f"delay {late}us from the end of a tick to the last axis") for line in told)
    assert "*sync_z/stage0_reg*/D" in (tmp_path / "axes.xdc").read_text()
    subprocess.run(["iverilog", "-g2012", "-Wall", "-o", "bench", "axes.v", "axes_tb.sv"], cwd=tmp_path, check=True)
    done = subprocess.run(["./bench"], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("PASS: position 24 of axis 0")


@pytest.mark.parametrize("words", only(AXES[-1:], AXES), ids=lambda words: f"{words[words.index('--axes') + 1]} axes")
def test_verilog_without_warnings(words: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "axes.v").write_text(export(core_of(words), "axes")["axes.v"])
    lint(["axes.v"], "axes", tmp_path)


def test_plan_of_each_axis(capsys: pytest.CaptureFixture[str]) -> None:
    """Its counts have times in rounds, here of 4 clocks, so what is known of a slow speed is a quarter as good."""
    core = "--method track --ppr 25 --clock 1MHz --tick 4ms --max-time 400ms --max-speed 100rad/s".split()
    resolution = []
    for axes in ([], ["--axes", "4"]):
        assert run("plan", *core, *axes) == 0
        told = rows(capsys)
        assert any(line.startswith("axes 4, each looked at every 4 clocks") for line in told) == bool(axes)
        first = next(k for k, line in enumerate(told) if line.startswith("speed (rad/s)")) + 1
        resolution.append(float(told[first].split()[4]))
    assert resolution[1] == pytest.approx(4 * resolution[0], rel=0.01)


def test_an_axis_has_one_motion_at_most(capsys: pytest.CaptureFixture[str]) -> None:
    assert run("simulate", *CORE, "--axes", "2", "--motion", "stop:1ms,stop:1ms,stop:1ms") == 2
    assert "must have at most one motion for each of the --axes 2, not 3" in capsys.readouterr().err


def test_no_figure_of_many(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--axes", "2", "--motion", "stop:10ms", "--plot", tmp_path / "p.png"]
    assert run("simulate", *CORE, *words) == 2
    assert "--plot must not be given together with --axes" in capsys.readouterr().err


def test_plan_tells_of_machines_and_of_a_velocity_that_is_narrow(capsys: pytest.CaptureFixture[str]) -> None:
    core = "--ppr 500 --tick 20us --method track --velocity-width 12 --axes 4".split()
    for speed, narrow in (["--max-speed", "400rad/s"], False), ([], True):
        assert run("plan", *core, *speed) == 0
        told = rows(capsys)
        assert any(re.match(r"axes 4, .* of a tick, on 2 machines$", line) for line in told)
        full_scale = next(line for line in told if line.startswith("full scale "))
        assert full_scale.endswith("; --max-speed makes an LSB with which it fits") == narrow


def test_verify(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "configurations", lambda method: [])
    monkeypatch.setattr(study, "AXES", AXES[2:3])
    monkeypatch.setattr(study, "WHEELS", ())
    assert run("verify", "--methods", "s", "--engines", "pysim", "--jobs", "1", "-o", tmp_path / "out") == 0
    assert rows(capsys)[1].split()[:3] == ["s", "pysim", "1"]


def test_registers_of_every_axis(tmp_path: Path) -> None:
    """The driver reads all axes of one capture, and is C99; nothing is beside the windows."""
    core = "--ppr 25 --clock 1MHz --tick 100us --max-time 400us --axes 3 --name axes".split()
    assert run("generate", *core, "--for", "litex", "-o", tmp_path) == 0
    driver = (tmp_path / "axes_driver.h").read_text()
    assert all(f"now->velocity_{axis} = axes_signed_32(velocity_{axis});" in driver for axis in range(3))
    assert all(f"now->standstill_{axis} = (status_{axis} & " in driver for axis in range(3))
    (tmp_path / "main.c").write_text('#include "axes_driver.h"\n')
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-fsyntax-only"]
    subprocess.run(["cc", *strict, "main.c"], cwd=tmp_path, check=True)
    assert "reg [2:0] a" in (tmp_path / "axes_tb.sv").read_text()
    assert '    "a": 3,\n' in (tmp_path / "axes_litex.py").read_text()
    lint(["axes.v"], "axes", tmp_path)
