"""Frameworks into which a core goes with files of their own."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tachometry.hdl.export.targets.litex import litex
from tachometry.hdl.export.targets.rio import rio
from tachometry.spec.control import AnySpec
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
        Texts by file name, of the spec, the name and the Verilog of the core.
    axes : bool
        Cores of many axes can go into it.
    """

    help: str
    bus: str
    files: Callable[[Any, str, str], dict[str, str]]
    axes: bool


TARGETS = {
    "rio": Target("plugin for RIO, with pins for LinuxCNC, in DIR/NAME_rio", "none", rio, axes=False),
    "litex": Target("module for LiteX in DIR/NAME_litex.py, with --bus wishbone", "wishbone", litex, axes=True),
}


def bus_for(target: str, bus: str | None) -> str:
    """Return the bus of a core for this target, which may be `none`; None stands for whatever the target needs.

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


def check_core(target: str, spec: AnySpec) -> None:
    """Refuse a core that is not for this target, with a ParameterError."""
    if target not in TARGETS or spec is spec.tachometer:
        return
    if spec.axes is None:
        raise ParameterError("target", "must not be given together with loop: targets are for a tachometer alone")
    if not TARGETS[target].axes:
        raise ParameterError("target", f"must be another than {target} with axes: its plugin is for one encoder each")


def target_files(target: str, spec: AnySpec, name: str, verilog: str) -> dict[str, str]:
    """Return texts by file name, of the name and the Verilog of the core; none without a target."""
    return TARGETS[target].files(spec, name, verilog) if target in TARGETS else {}
