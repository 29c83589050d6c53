"""The gates of extras, one file each: `hdl/extras/NAME.py` has a component `Gates`."""

from importlib import import_module

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.wires.ports import follow
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.extra import Extra


def gates_of(extra: Extra, spec: TachometerSpec) -> wiring.Component:
    """Return the gates of an extra of this core."""
    gates: wiring.Component = import_module(f"{__name__}.{extra.name}").Gates.of(extra, spec)
    return gates


def place(m: Module, core: wiring.Component, extras: dict[str, wiring.Component]) -> None:
    """Put extras into a core: their ports are connected to ports of the core that have the same names."""
    for name, box in extras.items():
        m.submodules[f"{name}_box"] = box  # the core has ports by the name
        ports = {port: member.flow for port, member in box.signature.members.items() if port in core.signature.members}
        follow(m, box, core, (port for port, flow in ports.items() if flow == In))
        follow(m, core, box, (port for port, flow in ports.items() if flow == Out))
