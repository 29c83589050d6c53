"""Compiled simulations of parts of a core, and Verilator as a reader of Verilog."""

from pathlib import Path

from amaranth.back import rtlil
from amaranth.lib import wiring

from tachometry.sim.engines.build import FLAGS, cached, compiler, digest, run, version
from tachometry.sim.engines.cxxrtl import headers, translate
from tachometry.sim.engines.verilator import verilate


def precompiled(folder: Path, name: str, *flags: str) -> list[str]:
    """Options with which g++, and only that, takes a header that it has compiled before: half the time of a small text.

    `folder` is one of include files; what is compiled with these options needs the same `flags`.
    """
    header = folder / name
    command = compiler()
    if "Free Software Foundation" not in version(command):
        return []

    def make(building: Path) -> Path:
        made = building / "header.gch"
        run([*command, *FLAGS, *flags, "-x", "c++-header", f"-I{folder}", "-o", made, header], "compiler")
        return made

    made = cached(digest(header.read_text(), version(command), FLAGS, flags), ".gch", make)
    return ["-include", str(made.with_suffix(""))]


def build(component: wiring.Component, main: str, folder: Path) -> Path:
    """Compile `component`, as the class `cxxrtl_design::p_top`, together with the C++ text `main`."""
    netlist = rtlil.convert(component, name="top", emit_src=False)
    (folder / "main.cc").write_text(translate(netlist) + main)
    options = [*FLAGS, *precompiled(headers(), "cxxrtl/cxxrtl.h"), f"-I{headers()}"]
    run([*compiler(), *options, "-o", "main", "main.cc"], "compiler", folder)
    return folder / "main"


def lint(files: list[str], top: str, folder: Path) -> None:
    """Let Verilator read Verilog files; any warning is an error."""
    verilate(["-Wall", "--lint-only", "--top-module", top, *files], folder)
