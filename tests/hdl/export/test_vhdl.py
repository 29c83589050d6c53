"""The package for VHDL declares the ports of the Verilog, and GHDL takes it."""

import json
import re
import subprocess
from pathlib import Path

import pytest
from support.nightly import nightly, only
from support.options import had_by

from tachometry.hdl.export import export
from tachometry.spec import METHODS, of_options, of_texts

BASE = {"ppr": "8", "clock": "1MHz", "tick": "80us", "max-time": "800us"}
ALL = {"index": "yes", "age": "yes", "bounds": "yes", "filter": "4", "unit": "rpm"}
LOOP = {"method": "m", "tick": "200us", "max-time": "2ms", "max-speed": "400rad/s", "loop": "yes", "gains": "inputs"}
CORES = {
    **{method: (had_by(method, BASE | ALL), "none") for method in METHODS},
    "external ticks": (BASE | {"external-tick": "yes"}, "none"),
    "axi-lite": (BASE | {"electrical": "3", "sincos": "yes"}, "axi-lite"),
    "uart": (BASE, "uart"),
    "axes": (BASE | {"method": "s", "axes": "3", "max-speed": "400rad/s", "parallel": "yes"}, "native"),
    "loop": (BASE | LOOP | {"command": "generator"}, "none"),
    "loop on a bus": (BASE | LOOP, "apb"),
}


PORT = r"^    (input|output) +(?:reg|wire) +(?:\[(\d+):0\] +)?(\w+)"


def made(core: str, name: str) -> dict[str, str]:
    texts, bus = CORES[core]
    if "axes" in texts or "loop" in texts:
        return export(of_options(texts), name, bus)
    return export(of_texts(core if core in METHODS else "s", texts), name, bus, 100_000 if bus == "uart" else None)


def ports_of(files: dict[str, str], name: str) -> dict[str, tuple[str, str]]:
    """Return direction and type of each port: bits of the Verilog, and signs of the manifest."""
    (top,) = re.findall(rf"^module {name} \($.*?^\);", files[f"{name}.v"], re.MULTILINE | re.DOTALL)
    found = re.findall(PORT, top, re.MULTILINE)
    signs = {port["name"]: port["signed"] for port in json.loads(files[f"{name}.json"])["ports"]}
    assert {port for *_, port in found} == signs.keys()
    return {
        port: (
            direction.removesuffix("put"),
            f"{'signed' if signs[port] else 'unsigned'}({high} downto 0)" if high else "std_logic",
        )
        for direction, high, port in found
    }


# Others have more of the same kinds of ports.
@pytest.mark.parametrize("core", only(["s", "axi-lite"], CORES))
def test_the_component_has_the_ports_of_the_verilog(core: str) -> None:
    files = made(core, "spindle")
    package = files["spindle_pkg.vhd"]
    assert package.isascii()
    declared = re.findall(r"^      (\w+) : (in|out) +(.+?);?$", package, re.MULTILINE)
    assert {name: (direction, kind) for name, direction, kind in declared} == ports_of(files, "spindle")


def analysed(files: dict[str, str], name: str, plain: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Return what GHDL says of the package, and of a design that connects every port of the component."""
    ports = ports_of(files, name)
    signals = "\n".join(f"  signal x_{port} : {kind};" for port, (_, kind) in ports.items())
    connected = ", ".join(f"{port} => x_{port}" for port in ports)
    (folder / "package.vhd").write_text(files[f"{name}_pkg.vhd"])
    (folder / "top.vhd").write_text(
        "library ieee;\nuse ieee.std_logic_1164.all;\nuse ieee.numeric_std.all;\n"
        f"use work.{plain.replace('@', name + '_pkg')}.all;\nentity top is end entity;\n"
        f"architecture a of top is\n{signals}\nbegin\n"
        f"  core : {plain.replace('@', name)} port map ({connected});\nend architecture;\n"
    )
    return subprocess.run(
        ["ghdl", "-a", "--std=93", "--workdir=.", "package.vhd", "top.vhd"], cwd=folder, capture_output=True, text=True
    )


# It needs GHDL, which `make ghdl` installs.
@nightly
@pytest.mark.parametrize("core", CORES)
def test_ghdl_takes_it_in_a_design(core: str, tmp_path: Path) -> None:
    done = analysed(made(core, "spindle"), "spindle", "@", tmp_path)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


@nightly
@pytest.mark.parametrize("name", ["_spindle", "spindle_", "spin__dle"])
def test_names_that_are_none_of_vhdl_are_extended(name: str, tmp_path: Path) -> None:
    done = analysed(made("axi-lite", name), name, "\\@\\", tmp_path)
    assert (done.returncode, done.stdout + done.stderr) == (0, "")


@nightly
def test_ghdl_finds_a_wrong_sign(tmp_path: Path) -> None:
    files = made("s", "spindle")
    wrong = re.sub(r"(velocity : out )signed", r"\1unsigned", files["spindle_pkg.vhd"])
    done = analysed(files | {"spindle_pkg.vhd": wrong}, "spindle", "@", tmp_path)
    assert done.returncode == 1
    assert "x_velocity" in done.stderr
