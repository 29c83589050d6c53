"""An IP for Vivado: IP-XACT (IEEE 1685-2009), and a module whose interfaces have the names that Vivado knows."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tachometry.hdl.export.registers.values import is_whole, sentences
from tachometry.hdl.export.render import render_files
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import STREAM, arranged
from tachometry.spec.registers.buses import Bus, ports_on, registers_on

_MADE = ("NAME_ip/component.xml", "NAME_ip/NAME_ip.v")
FILES = (*_MADE, "NAME_ip/NAME.v", "NAME_ip/NAME.xdc")
_VIEWS = {"xilinx_anylanguagesynthesis": "synthesis", "xilinx_anylanguagebehavioralsimulation": "simulation"}
_ACCESS = {"ro": "read-only", "rw": "read-write", "wo": "write-only"}
_LEAST_RANGE = 4096  # bytes, of a segment of Vivado's address map
# An IP that names no family fits none.
_FAMILIES = (
    "spartan7 artix7 kintex7 virtex7 zynq spartanuplus artixuplus kintexu virtexu kintexuplus virtexuplus "
    "virtexuplusHBM zynquplus versal"
).split()


@dataclass(frozen=True)
class _Interface:
    """Names in Vivado of a bus, of its clock and of its reset."""

    name: str  # of the interface; ports begin with it
    kind: str  # of its definition
    # clock and reset: names of ports; the reset is active low
    clock: str
    reset: str


_INTERFACES = {
    "axi-lite": _Interface("s_axi", "aximm", "aclk", "aresetn"),
    "apb": _Interface("s_apb", "apb", "pclk", "presetn"),
}
BUSES = (*_INTERFACES, "none")


def _holes(spec: AnySpec, bus: Bus | None) -> dict[str, Any]:
    if bus is None:
        return {"clock": "clk", "reset": "rst", "polarity": "ACTIVE_HIGH", "bus": "", "irq": False}
    there, registers = _INTERFACES[bus.name], registers_on(spec, bus)
    return {
        "clock": there.clock,
        "reset": there.reset,
        "polarity": "ACTIVE_LOW",
        "bus": there.name,
        "registers": registers,
        "irq": registers.irq,
        "range": max(_LEAST_RANGE, 1 << registers.address_width),
    }


def vivado(spec: AnySpec, name: str, bus: Bus | None, made: Mapping[str, str]) -> dict[str, str]:
    """Return an IP in the folder `NAME_ip`, whose module contains the core, with copies, as `Target.files` says."""
    ports = arranged(ports_on(spec, bus))
    there = _INTERFACES[bus.name] if bus else None
    outer = {port.name: port.name for port in ports}
    kinds = {STREAM: "axis"} if spec.tachometer.ports.streamed else {}
    if there is not None:
        outer |= {"clk": there.clock, "rst": there.reset}
        kinds = {there.name: there.kind} | kinds
    holes = _holes(spec, bus)
    clock_hz = spec.timing.clock_hz
    names = [port.name for port in ports]
    interfaces = [
        (one, kind, {name: name.removeprefix(f"{one}_").upper() for name in names if name.startswith(f"{one}_")})
        for one, kind in kinds.items()
    ]
    associated = {"ASSOCIATED_BUSIF": ":".join(kinds)} if kinds else {}
    files = render_files(
        _MADE,
        name,
        **holes,
        interfaces=interfaces,
        logical={port: f"{kind}:1.0 {one} {its[port]}" for one, kind, its in interfaces for port in its},
        method=spec.tachometer.method,
        ports=ports,
        outer=outer,
        clock_hz=clock_hz,
        clock_parameters={**associated, "ASSOCIATED_RESET": holes["reset"], "FREQ_HZ": clock_hz},
        views=_VIEWS,
        families=_FAMILIES,
        access=_ACCESS,
        sentences=sentences,
        is_whole=is_whole,
        options={option.replace("-", "_"): text for option, text in spec.options.items()},
    )
    return files | {f"{name}_ip/{file}": made[file] for file in (f"{name}.v", f"{name}.xdc")}
