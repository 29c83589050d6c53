"""Compiled simulations of parts of a core, and Verilator as a reader of Verilog."""

from pathlib import Path

from amaranth.back import rtlil
from amaranth.lib import wiring

from tachometry.sim.engines.build import compiler, flags, precompiled, run
from tachometry.sim.engines.cxxrtl import headers, translate
from tachometry.sim.engines.verilator import verilate


def build(component: wiring.Component, main: str, folder: Path) -> Path:
    """Compile `component`, as the class `cxxrtl_design::p_top`, together with the C++ text `main`."""
    netlist = rtlil.convert(component, name="top", emit_src=False)
    (folder / "main.cc").write_text(translate(netlist) + main)
    options = [*flags(), *precompiled(headers(), "cxxrtl/cxxrtl.h"), f"-I{headers()}"]
    run([*compiler(), *options, "-o", "main", "main.cc"], "compiler", folder)
    return folder / "main"


def lint(files: list[str], top: str, folder: Path) -> None:
    """Let Verilator read Verilog files; any warning is an error."""
    verilate(["-Wall", "--lint-only", "--top-module", top, *files], folder)
