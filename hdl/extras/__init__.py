"""The gates of extras, one file each: `hdl/extras/NAME.py` has a component `Gates`.

An input of it has the name of a port of the core, of one of `Tachometer._taps`, or of a field that a program writes; an
output that of a port of the core, if it is one. `clear` is high when a program clears, and `idle` says what a
simulation may skip.
"""

from collections.abc import Collection, Mapping
from importlib import import_module

from amaranth import Module, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.wires.ports import drive, follow
from tachometry.spec import CoreSpec, TachometerSpec
from tachometry.spec.core.extras.extra import Extra


def gates_of(extra: Extra, spec: CoreSpec) -> wiring.Component:
    """Return the gates of an extra of this core."""
    gates: wiring.Component = import_module(f"{__name__}.{extra.name}").Gates.of(extra, spec)
    return gates


def place(m: Module, core: wiring.Component, extras: Mapping[str, wiring.Component], taps: Mapping[str, Value]) -> None:
    """Put extras into a core: their ports are connected to ports and taps of the core that have the same names."""
    shared = core.signature.members
    for name, box in extras.items():
        m.submodules[f"{name}_box"] = box  # the core has ports by the name
        for port, member in box.signature.members.items():
            if member.flow == In and port in taps:
                drive(m, box, {port: taps[port]})
            elif port in shared:
                follow(m, *((box, core) if member.flow == In else (core, box)), [port])


def check_inputs(spec: TachometerSpec, extras: Mapping[str, wiring.Component], known: Collection[str]) -> None:
    """Raise LookupError for an input of extras that is no port or tap of the core, and that no register sets."""
    for extra in spec.extras:
        written = {"clear", *(field.port for _, _, fields, _ in extra.registers(spec) for field in fields)}
        inputs = {port for port, member in extras[extra.name].signature.members.items() if member.flow == In}
        if unknown := sorted(inputs - written - {*known}):
            raise LookupError(f"{extra.name} has inputs that nothing drives: {', '.join(unknown)}")
