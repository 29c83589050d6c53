"""Engines are known by name, and chosen here."""

from tachometry.sim.build import compiler, find_compiler
from tachometry.sim.engines.engine import Engine

ENGINES = ("pysim", "cxxrtl", "verilator")
NAMES = (*ENGINES, "cxxrtl-every-clock")


def pick(name: str = "auto") -> Engine:
    """Return the engine of a name; `auto` is cxxrtl where there is a C++ compiler, and pysim where there is none.

    It raises ValueError if there is no engine of that name, and OSError if it lacks what it needs here, with a line
    that says what to install.
    """
    if name == "auto":
        name = "pysim" if find_compiler() is None else "cxxrtl"
    if name == "pysim":
        from tachometry.sim.engines.pysim import PySim

        return PySim()
    if name in ("cxxrtl", "cxxrtl-every-clock"):
        from tachometry.sim.engines.cxxrtl import Cxxrtl

        compiler()
        return Cxxrtl(every_clock=name != "cxxrtl")
    if name == "verilator":
        from tachometry.sim.engines.verilator import Verilator, home

        compiler()
        home()
        return Verilator()
    raise ValueError(f"engine must be one of auto, {', '.join(NAMES)}, not {name!r}")


def present() -> list[str]:
    """Return names of the engines that can be used here."""
    found = []
    for name in ENGINES:
        try:
            pick(name)
        except OSError:
            continue
        found.append(name)
    return found
