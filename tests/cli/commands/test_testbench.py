"""`tachometry generate --testbench cocotb`: the bench passes on the core, and fails on one with anything wrong."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from support.command import without
from support.nightly import nightly, only

from tachometry.cli.main import main
from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.testbench.vectors import usual_motion
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.extras.position_compare import Compare, PositionCompare
from tachometry.spec.language.provenance import notice

SMALL = "--ppr 8 --clock 1MHz --tick 8us --max-time 160us"
CASES = {
    "s": "--method s --index --index-reset --filter 2 --age --bounds",
    "s in rpm": "--method s --no-cancel --external-tick --max-speed 30000rpm --unit rpm --velocity-width 12",
    "m": "--method m --average 3 --lowpass 2000rad/s",
    "t": "--method t --bounds",
    "mt": "--method mt --index --age --external-tick --max-tick-period 12us",
    "rairan": "--method rairan --bounds --filter 1",
    "reads": "--method m --sensor sampled --bits 9 --ppr 512 --max-speed 3000rpm",
    "axes": "--axes 3 --tick 64us --max-time 640us --filter 5 --index --unit rpm",
    "axes, held": "--axes 2 --parallel --tick 64us --max-time 640us --external-tick --index --index-reset",
}
LOOP = (
    "--ppr 25 --clock 1MHz --tick 100us --max-time 1ms --max-speed 2000rad/s --loop --loop-multiplier parallel "
    "--inertia 1e-5 --motion ramp:0:300rad/s:8ms+sine:40rad/s:300Hz:7ms+stop:5ms"
)
LOOPS = {"commands": "--index --no-synchronised", "generator": "--command generator --gains inputs"}


def generate(folder: Path, *words: str) -> int:
    with pytest.raises(SystemExit) as stop:
        main(["generate", *words, "--testbench", "cocotb", "--name", "spindle", "-o", str(folder)])
    assert isinstance(stop.value.code, int)
    return stop.value.code


def run(folder: Path, simulator: str, *more: str) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTEST", "COCOTB"))}
    return subprocess.run(
        [sys.executable, *more, folder / "test_spindle.py"],
        cwd=folder,
        env=environment | {"SIM": simulator, "CXXFLAGS": "-O0"},
        capture_output=True,
        text=True,
    )


def play(folder: Path, simulator: str = "icarus", *more: str) -> str:
    """Return what the bench says, empty if it passes; tachometry is not there."""
    done = run(folder, simulator, *more)
    said = done.stdout + done.stderr
    assert done.returncode in (0, 1), said
    assert ("PASS=1 FAIL=0" in said) == (done.returncode == 0), said
    found = re.search(r"AssertionError: (clock .*)", said)
    assert (found is None) == (done.returncode == 0), said
    return "" if found is None else found[1]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Return what gives the folder of a case, with the bench that was made once for all tests."""

    @cache
    def made(case: str) -> Path:
        folder = tmp_path_factory.mktemp("bench")
        words = CASES[case].split()
        assert generate(folder, *without(SMALL.split(), words), *words) == 0
        return folder

    return made


# S has most options, and reads have faults; a core of another method is played with a motion of its own below.
@pytest.mark.parametrize("case", only(["s", "reads"], CASES))
def test_passes_in_icarus(case: str, bench: Callable[[str], Path]) -> None:
    assert play(bench(case)) == ""


@nightly  # that of a wrong sign runs as far, and tests/hdl/core/test_loop_core.py has the exported loop
def test_a_loop_passes_in_icarus(tmp_path: Path) -> None:
    assert generate(tmp_path, *LOOP.split(), *LOOPS["generator"].split()) == 0
    vectors = json.loads((tmp_path / "spindle_vectors.json").read_text())
    assert len({row[1] for row in vectors["strobes"]["current_valid"]["rows"]}) > 20
    assert play(tmp_path) == ""


def test_unknown_simulator_is_told_in_a_line(bench: Callable[[str], Path]) -> None:
    done = run(bench("s"), "modelsim")
    assert done.returncode == 1
    assert re.fullmatch(r"test_spindle\.py: Simulator 'modelsim' is not [^\n]*icarus[^\n]*\n", done.stderr)


def test_passes_in_pytest(tmp_path: Path) -> None:
    assert generate(tmp_path, *SMALL.split()) == 0
    assert play(tmp_path, "icarus", "-m", "pytest", "-s") == ""


def test_an_output_that_is_not_held_fails(tmp_path: Path) -> None:
    """The velocity is right while `velocity_valid` is high, and wrong after."""
    assert generate(tmp_path, *SMALL.split(), "--method", "s") == 0
    verilog = tmp_path / "spindle.v"
    text = verilog.read_text()
    inner = re.sub(r"\bmodule spindle ?\(", "module inner(", text)
    assert inner != text
    ports = json.loads((tmp_path / "spindle.json").read_text())["ports"]
    listed = ", ".join(f"{port['direction']} [{port['width'] - 1}:0] {port['name']}" for port in ports)
    wired = ", ".join(f".{port['name']}({port['name']})" for port in ports if port["name"] != "velocity")
    wrapper = (
        f"module spindle({listed}); wire [{ports_width(ports, 'velocity') - 1}:0] right; "
        f"inner inner({wired}, .velocity(right)); assign velocity = velocity_valid ? right : ~right; endmodule\n"
    )
    verilog.write_text(inner + wrapper)
    assert re.fullmatch(r"clock \d+, with tick: velocity is -?\d+, not -?\d+", play(tmp_path))


def ports_width(ports: list[dict[str, Any]], name: str) -> int:
    return next(port["width"] for port in ports if port["name"] == name)


@pytest.mark.parametrize("case", only(["s", "mt", "rairan"], CASES))  # all ports that there are
def test_every_output_and_situation_is_in_the_vectors(case: str, bench: Callable[[str], Path]) -> None:
    ports = json.loads((bench(case) / "spindle.json").read_text())["ports"]
    vectors = json.loads((bench(case) / "spindle_vectors.json").read_text())
    strobes = vectors["strobes"]
    assert {name for name, strobe in strobes.items() if not strobe["rows"]} <= {"index_missed", "index_wide"}
    outputs = {port["name"] for port in ports if port["direction"] == "output"}
    assert outputs == strobes.keys() | {name for strobe in strobes.values() for name in strobe["ports"]}
    assert {"clk", "rst", *vectors["pins"]} == {port["name"] for port in ports} - outputs
    rows = strobes["velocity_valid"]["rows"]
    named = [name.removesuffix("_0") for name in strobes["velocity_valid"]["ports"]]
    shown = {name: {row[k] for row in rows} for k, name in enumerate(named, 1)}
    assert min(shown["velocity"]) < 0 < max(shown["velocity"])
    assert 0 in shown["velocity"]
    if "--method m " not in CASES[case]:
        assert shown["forced"] == {0, 1}


def test_stands_on_its_own_and_is_the_same_again(bench: Callable[[str], Path], tmp_path: Path) -> None:
    assert generate(tmp_path, *SMALL.split(), *CASES["s"].split()) == 0
    for name in ("test_spindle.py", "spindle_vectors.json"):
        assert (bench("s") / name).read_bytes() == (tmp_path / name).read_bytes()
    text = (tmp_path / "test_spindle.py").read_text()
    assert text.startswith(notice("#"))
    assert "tachometry" not in text.removeprefix(notice("#"))


def test_usual_motion_stays_short_for_every_timing() -> None:
    for cycles, longest in ((1, 2), (1, 1 << 20), (960, 500), (1 << 20, 1 << 20)):
        spec = STachometer(encoder=Encoder(500, 4), timing=Timing(48_000_000, cycles, longest))
        recording = usual_motion(spec)
        assert 3 * cycles <= recording.duration * 48e6 <= 1_000_000 + 4 * cycles
        assert len(recording.time) <= 100_000


@pytest.mark.parametrize("asked", ["-2000:500:0:10us", "300:100:0:1us:backward"])
def test_usual_motion_goes_over_the_positions_of_compare(asked: str) -> None:
    compare = Compare.parse("position_compare", asked)
    spec = STachometer(encoder=Encoder(500, 4), timing=Timing.parse(), extras=(PositionCompare(places=compare),))
    run = golden.run(spec, PinTrace.of(usual_motion(spec), spec))
    assert run.tables["position_compare_valid"].position_compare_position[:3].tolist() == [
        compare.start + k * compare.apart for k in range(3)
    ]


def test_own_motion(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    motion = ["--motion", "constant:100rad/s:4ms", "--lost", "0.2"]
    assert generate(tmp_path, *SMALL.split(), *motion) == 0
    assert json.loads((tmp_path / "spindle_vectors.json").read_text())["clocks"] == 4000
    assert play(tmp_path) == ""
    capsys.readouterr()
    assert generate(tmp_path, *SMALL.split(), "--motion", "stop:2us") == 2
    assert "--motion must last for a tick, not for 2 clocks" in capsys.readouterr().err
    with pytest.raises(SystemExit, match="2"):
        main(["generate", *SMALL.split(), "--motion", "stop:1s", "-o", str(tmp_path / "new")])
    assert "--motion must be given together with --testbench" in capsys.readouterr().err
