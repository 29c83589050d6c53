"""Frameworks into which a core goes with files of their own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.hdl.export.targets import linux, quartus, vivado
from tachometry.hdl.export.targets.litex import FILES as LITEX
from tachometry.hdl.export.targets.litex import litex
from tachometry.hdl.export.targets.rio import FILES as RIO
from tachometry.hdl.export.targets.rio import check, rio
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.language.option import ParameterError
from tachometry.spec.registers.buses import Bus


@dataclass(frozen=True)
class Target:
    """Describes a framework."""

    help: str  # what is made for it, for --help
    buses: tuple[str, ...]  # the buses that the core can have for it, first that which it has if none is asked for
    names: tuple[str, ...]  # the files, in which NAME stands for that of the module
    # texts by file name, of the spec, the name and the bus of the core, and of its files without a target
    files: Callable[[Any, str, Any, Mapping[str, str]], dict[str, str]]
    loops: bool = False  # cores with a control loop can go into it
    check: Callable[[Any], None] | None = None  # raises ParameterError for a core that cannot


TARGETS = {
    "rio": Target("plugin for RIO, with pins for LinuxCNC, in DIR/NAME_rio", ("none",), RIO, rio, check=check),
    "litex": Target("module for LiteX in DIR/NAME_litex.py, with --bus wishbone", ("wishbone",), LITEX, litex),
    "vivado": Target(
        "IP for Vivado (IP-XACT) in DIR/NAME_ip, with --bus axi-lite, apb or none",
        vivado.BUSES,
        vivado.FILES,
        vivado.vivado,
        loops=True,
    ),
    "quartus": Target(
        "component for Platform Designer of Quartus in DIR/NAME_hw.tcl, with --bus axi-lite, apb or none",
        quartus.BUSES,
        quartus.FILES,
        quartus.quartus,
        loops=True,
    ),
    "linux": Target(
        "programs in C and Python and a device-tree overlay in DIR/NAME_uio.c, DIR/NAME_uio.py and DIR/NAME.dtso, with "
        "--bus axi-lite, apb or wishbone",
        linux.BUSES,
        linux.FILES,
        linux.linux,
        loops=True,
    ),
}


def bus_for(target: str, bus: str | None) -> str:
    """Return the bus of a core for this target, which may be `none`; None stands for whatever the target needs.

    It raises ParameterError if there is no such target, or it needs another bus.
    """
    if target != "none" and target not in TARGETS:
        raise ParameterError("target", f"must be one of none, {', '.join(TARGETS)}, not {target!r}")
    buses = TARGETS[target].buses if target in TARGETS else (bus or "none",)
    if bus not in (None, *buses):
        raise ParameterError("bus", f"must be {' or '.join(buses)} for {target}, not {bus}")
    return bus or buses[0]


def check_core(target: str, spec: AnySpec) -> None:
    """Refuse a core that is not for this target, with a ParameterError."""
    if (about := TARGETS.get(target)) is None:
        return
    if isinstance(spec, LoopSpec) and not about.loops:
        raise ParameterError("target", f"must not be {target} with a loop: it is for a tachometer alone")
    if about.check is not None:
        about.check(spec)


def target_files(target: str, spec: AnySpec, name: str, bus: Bus | None, made: Mapping[str, str]) -> dict[str, str]:
    """Return texts by file name, of a core and of the files that it has without a target; none without a target."""
    return TARGETS[target].files(spec, name, bus, made) if target in TARGETS else {}
