"""The files beside the Verilog name what is there, and run."""

import fnmatch
import json
import math
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest
from support import docs
from support.compiled import lint
from support.nightly import only, only_rows
from support.options import had_by

from tachometry.hdl.export import export
from tachometry.hdl.export.targets.target import TARGETS
from tachometry.sim.engines.verilator import home
from tachometry.spec import METHODS, common_options, of_texts, own_options
from tachometry.spec.core.extras.stream import READY
from tachometry.spec.language.provenance import LICENSE, generator, version

BIN = Path(sys.executable).parent
PAGE = docs.page("reference/manifest.md")
BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us"}
CASES = {
    "s": {"external-tick": "yes", "index": "yes", "filter": "4", "unit": "rpm", "bounds": "yes", "age": "yes"},
    "m": {"decoding": "1", "lowpass": "20Hz", "probe": "2", "stream": "axi"},
    "t": {"decoding": "2", "index": "yes", "index-reset": "yes"},
    "mt": {"external-tick": "yes", "bounds": "yes"},
    "rairan": {"filter": "100", "bounds": "yes"},
    "track": {"external-tick": "yes", "unit": "rad/s"},
}
# The unit of the velocity, and the speed at which the smoke test turns.
FASTEST = {
    "s": ("rpm", 60 * 1e6 / 24 / 32, 1e-5),  # a count of 32 in 24 clocks
    "m": ("count/tick", 1 - math.exp(-2 * math.pi * 20 * 10 * 80e-6), 1e-3),  # a count a tick, filtered for ten ticks
    "t": ("count/tick", 2, 1e-5),
    "mt": ("count/tick", 4, 1e-5),
    "rairan": ("count/tick", 80 / 216, 0.1),  # in ticks of 80 clocks it sees 80/216 as 2/5
    "track": ("rad/s", 2 * math.pi * 1e6 / 20 / 32, 1),  # it has not settled
}


@cache
def made(method: str, bus: str = "none") -> dict[str, str]:
    spec = of_texts(method, had_by(method, BASE | CASES.get(method, {})))
    return export(spec, "spindle", bus, 100_000 if bus == "uart" else None)


def run(folder: Path, *command: str | Path, **environment: str) -> str:
    done = subprocess.run(
        list(map(str, command)), cwd=folder, env=os.environ | environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def test_every_file_names_version_and_licence() -> None:
    targets = [export(of_texts("m", BASE), "spindle", target=target) for target in TARGETS]
    for file, text in [item for files in (made("s"), *targets) for item in files.items()]:
        assert generator() in text, file
        assert LICENSE in text, file
        assert text.endswith("\n"), file
    assert f"name: ::spindle:{version()}\n" in made("s")["spindle.core"]


# Each kind of bus, and the method of the others' ports.
@pytest.mark.parametrize(
    ("method", "bus"),
    only_rows(
        [("s", "none"), ("m", "spi"), ("m", "uart")],
        [*((method, "none") for method in METHODS), ("m", "spi"), ("m", "uart")],
    ),
)
def test_the_smoke_test_includes_the_template_and_passes(method: str, bus: str, tmp_path: Path) -> None:
    files = made(method, bus)
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    said = run(tmp_path, "iverilog", "-g2012", "-Wall", "-o", "x.vvp", "spindle.v", "spindle_tb.sv")
    assert said == ""
    lint(["--timing", "spindle.v", "spindle_tb.sv"], "spindle_tb", tmp_path)
    counts = 24 * int(CASES[method].get("decoding", "4")) // 4
    text = run(tmp_path, "vvp", "-n", "x.vvp")
    passed = re.match(rf"PASS: position {counts}, [1-9]\d* updates, velocity from (\S+) to (\S+) (\S+)\n", text)
    assert passed is not None, text
    unit, fastest, within = FASTEST[method]
    assert float(passed[1]) <= 0 < float(passed[2]) == pytest.approx(fastest, rel=within)
    assert passed[3] == unit
    (top,) = re.findall(r"^module spindle \($.*?^\);", files["spindle.v"], re.MULTILINE | re.DOTALL)
    ports = re.findall(r"^    (?:in|out)put +(?:reg|wire) +(?:\[\d+:0\] +)?(\w+)", top, re.MULTILINE)
    assert ports[:3] == ["clk", "rst", "a"]
    assert {port["name"] for port in json.loads(files["spindle.json"])["ports"]} == {*ports}
    assert re.findall(r"^  \.(\w+)\(\1\)", files["spindle_inst.v"], re.MULTILINE) == ports
    assert re.findall(r"^      (\w+) : (?:in|out) ", files["spindle_pkg.vhd"], re.MULTILINE) == ports
    declared = re.findall(r"^(?://   )?wire (?:signed )?(?:\[\d+:0\] )?(\w+);", files["spindle_inst.v"], re.MULTILINE)
    assert declared == ports


def test_the_smoke_test_fails_on_a_wrong_core(tmp_path: Path) -> None:
    files = made("m")
    wrong = files["spindle_inst.v"].replace(".a(a)", ".a(b)").replace(".b(b)", ".b(a)")
    for file, text in {**files, "spindle_inst.v": wrong}.items():
        (tmp_path / file).write_text(text)
    run(tmp_path, "iverilog", "-g2012", "-o", "x.vvp", "spindle.v", "spindle_tb.sv")
    done = subprocess.run(["vvp", "-n", "x.vvp"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1
    # Updates before the shaft turns back show a negative velocity.
    assert "FAIL: position -6 instead of 6, 8 errors" in done.stdout + done.stderr


def flip_flops(verilog: str) -> dict[str, str]:
    """Return paths of the synchronisers' flip-flops from the top, with a slash, and their attributes."""
    modules = dict(re.findall(r"^module (\w+) \($(.*?)^endmodule", verilog, re.MULTILINE | re.DOTALL))

    def below(module: str, path: str) -> dict[str, str]:
        text = modules[module]
        found: dict[str, str] = {}
        for attributes, name in re.findall(r"(\(\*.*\*\))\s(?: +output +)?reg +(stage\d)\b", text):
            found[path + name] = found.get(path + name, "") + attributes
        for inner, name in re.findall(r"^    (\w+) (\w+) \($", text, re.MULTILINE):
            found |= below(inner, f"{path}{name}/") if inner in modules else {}
        return found

    return below("spindle", "spindle_inst/")


# All pins that a core can have.
@pytest.mark.parametrize(
    ("method", "bus", "more"),
    [("s", "none", []), ("m", "spi", ["spi_sck", "spi_mosi", "spi_cs_n"]), ("m", "uart", ["uart_rx"])],
)
def test_constraints_meet_every_synchroniser_once(method: str, bus: str, more: list[str]) -> None:
    files = made(method, bus)
    found = flip_flops(files["spindle.v"])
    spec = of_texts(method, BASE | CASES[method])
    pins = [pin.name for pin in spec.ports.pins if pin.name not in ("probe", "probe_arm", READY)] + [
        *spec.front_end.sensed,
        *more,
    ]
    assert len(found) == 2 * len(pins)
    first = [path for path in found if path.endswith("stage0")]
    # As Vivado, Quartus Standard, and others name them.
    vivado = [f"{path}_reg/D" for path in first]
    quartus = [re.sub(r"(\w+)/", r"e.\1:\1|", path) for path in first]
    kinds = {
        r"get_pins -hierarchical -filter \{NAME =~ (.*)\}": ("xdc", vivado),
        r"get_registers \{(.*)\}": ("sdc", quartus),
        r"get_cells -hierarchical \{(.*)\}": ("sdc", vivado),
    }
    for pattern, (suffix, names) in kinds.items():
        wanted = re.findall(pattern, files[f"spindle.{suffix}"])
        assert len(wanted) == len(pins)
        for name in names:
            assert [bool(fnmatch.fnmatchcase(name, one)) for one in wanted].count(True) == 1, (name, wanted)
    cells = re.findall(r"get_cells -hierarchical -filter \{NAME =~ (.*)\}", files["spindle.xdc"])
    for path, attributes in found.items():
        assert sum(fnmatch.fnmatchcase(f"{path}_reg", one) for one in cells) == 1
        assert '(* ASYNC_REG = "TRUE" *)' in attributes, path


@pytest.mark.parametrize("quartus", [False, True])
def test_constraints_are_tcl(quartus: bool) -> None:
    tcl = pytest.importorskip("tkinter").Tcl()
    tcl.eval("set said {}")
    known = ["get_pins", "get_cells", *(["get_registers"] if quartus else [])]
    for name in known:
        tcl.eval(f"proc {name} args {{return [list {name} {{*}}$args]}}")
    for name in ("set_false_path", "set_property"):
        tcl.eval(f"proc {name} args {{lappend ::said [list {name} {{*}}$args]}}")
    files = made("s")
    tcl.eval(files["spindle.sdc"])
    said = tcl.splitlist(tcl.eval("set said"))
    assert len(said) == 4
    assert all(("get_registers" if quartus else "get_cells") in line for line in said)
    tcl.eval("set said {}")
    tcl.eval(files["spindle.xdc"])
    assert len(tcl.splitlist(tcl.eval("set said"))) == 8


# The bus only adds ports, which the next test compiles, too.
@pytest.mark.parametrize("bus", only(["none"], ["none", "wishbone"]))
def test_fusesoc_runs_every_target(bus: str, tmp_path: Path) -> None:
    files = made("s", bus)
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    # An environment as `make venv` leaves it, with the packages of this one.
    venv = tmp_path / "venv"
    (venv / "bin").mkdir(parents=True)
    (venv / "lib").symlink_to(home().parents[2])
    run(docs.DOCS.parent, "make", f"VENV={venv}", "-o", venv / ".test", "venv", MAKEFLAGS="")
    path = f"{venv / 'bin'}{os.pathsep}{os.environ['PATH']}"
    targets = re.findall(r"^  (\w+):\n    filesets:", files["spindle.core"], re.MULTILINE)
    assert targets == ["default", "lint", "sim"]
    for target in targets:
        command = (BIN / "fusesoc", "--cores-root", ".", "run", "--target", target, "spindle")
        home_ = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
        said = run(tmp_path, *command, PATH=path, **home_)
        assert "Warning" not in said, said
        assert ("PASS: position 24" in said) == (target == "sim")


def test_fusesoc_finds_what_programs_need(tmp_path: Path) -> None:
    """With the flags `driver`, `registers` and `vhdl`, and without them not; a core without a bus has no registers."""
    for file, text in made("s", "native").items():
        (tmp_path / file).write_text(text)
    home_ = {"HOME": str(tmp_path), "XDG_CONFIG_HOME": str(tmp_path)}
    of_flags = {
        "driver": ["spindle_driver.h", "spindle_regs.h"],
        "registers": ["spindle.rdl"],
        "vhdl": ["spindle_pkg.vhd"],
    }
    for flags in ([], ["driver"], ["registers", "vhdl"]):
        words = [f"--flag={flag}" for flag in flags]
        run(tmp_path, BIN / "fusesoc", "--cores-root", ".", "run", "--setup", *words, "spindle", **home_)
        (edam,) = tmp_path.glob("build/*/default/*.eda.yml")
        found = {Path(name).name for name in re.findall(r"name: (\S+)", edam.read_text())}
        for flag, names in of_flags.items():
            assert (found & {*names} == {*names}) == (flag in flags), (flags, found)
            assert found.isdisjoint(names) == (flag not in flags), (flags, found)
    assert "driver" not in made("s")["spindle.core"]


def keys(item: object, path: str = "") -> set[str]:
    """Return paths of all keys: `velocity.width`, `ports[].name`."""
    if isinstance(item, dict):
        below = [keys(value, f"{path}.{key}" if path else key) for key, value in item.items()]
        return {f"{path}.{key}" if path else key for key in item}.union(*below)
    if isinstance(item, list):
        return set().union(*(keys(value, f"{path}[]") for value in item))
    return set()


@pytest.mark.parametrize(("method", "bus"), [*((method, "none") for method in METHODS), ("s", "native")])
def test_every_key_of_the_manifest_is_documented(method: str, bus: str) -> None:
    found = keys(json.loads(made(method, bus)["spindle.json"]))
    told = set(re.findall(r"^\| `([\w.\[\]-]+)` \|", PAGE, re.MULTILINE))
    assert {key for key in found if not key.startswith(("parameters.", "options.", "files."))} <= told
    options = {f"parameters.{about.parameter}" for about in (*common_options(), *own_options(method))}
    assert {key for key in found if key.startswith("parameters.")} - options - {"parameters.method"} <= told
