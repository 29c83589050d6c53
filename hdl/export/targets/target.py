"""Frameworks into which a core goes with files of their own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tachometry.hdl.export.targets.litex import litex, litex_files
from tachometry.hdl.export.targets.rio import rio, rio_files
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.option import ParameterError


@dataclass(frozen=True)
class Target:
    """A framework.

    Parameters
    ----------
    help : str
        What is made for it, for --help.
    bus : str
        The bus that the core has for it.
    files : callable
        Names of its files, of the name of the core.
    texts : callable
        Texts by file name, of the spec, the name and the Verilog of the core.
    """

    help: str
    bus: str
    files: Callable[[str], tuple[str, ...]]
    texts: Callable[[TachometerSpec, str, str], Mapping[str, str]]


TARGETS = {
    "rio": Target("plugin for RIO, with pins for LinuxCNC, in DIR/NAME_rio", "none", rio_files, rio),
    "litex": Target("module for LiteX in DIR/NAME_litex.py, with --bus wishbone", "wishbone", litex_files, litex),
}


def bus_for(target: str, bus: str | None) -> str:
    """The bus of a core for this target, which may be `none`; a bus of None stands for whatever the target needs.

    Raises
    ------
    ParameterError
        If there is no such target, or it needs another bus.
    """
    if target != "none" and target not in TARGETS:
        raise ParameterError("target", f"must be one of none, {', '.join(TARGETS)}, not {target!r}")
    needed = TARGETS[target].bus if target in TARGETS else bus or "none"
    if bus not in (None, needed):
        raise ParameterError("bus", f"must be {needed} for {target}, not {bus}")
    return needed
