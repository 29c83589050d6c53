"""Boxes; ports of the exported core as members of a component, and ports of boxes that have the same names."""

from collections.abc import Iterable, Mapping
from types import MappingProxyType
from typing import Any, TypeVar

from amaranth import Module, ValueLike, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.spec import Port

_Name = TypeVar("_Name", str, int)
_FLOW = {"input": In, "output": Out}


class Box(wiring.Component):
    """Component that fills its own module; its members are given by their names, or as a dictionary."""

    def __init__(self, signature: Mapping[str, Any] = MappingProxyType({}), /, **members: Any) -> None:
        super().__init__({**signature, **members}, src_loc_at=1)

    def elaborate(self, platform: object) -> Module:
        m = Module()
        self.build(m)
        return m

    def build(self, m: Module) -> None:
        """Add statements and inner boxes to the module."""


def members(ports: Iterable[Port]) -> dict[str, Any]:
    """Return members by the names of the ports, less clock and reset, which are those of the domain."""
    return {
        port.name: _FLOW[port.direction](signed(port.width) if port.signed else port.width)
        for port in ports
        if port.name not in ("clk", "rst")
    }


def only_if(condition: object, **flows: Any) -> dict[str, Any]:
    """Return members that a box has only under a condition."""
    return flows if condition else {}


def by_name(box: wiring.Component, names: Iterable[_Name], form: str = "{}") -> dict[_Name, Any]:
    """Return ports of a box by names or numbers, which stand in the names of the ports where `form` has braces."""
    return {name: getattr(box, form.format(name)) for name in names}


def drive(m: Module, box: wiring.Component, values: Mapping[_Name, ValueLike], form: str = "{}") -> None:
    """Set ports of a box to values; see `by_name`."""
    m.d.comb += [port.eq(values[name]) for name, port in by_name(box, values, form).items()]


def follow(m: Module, box: wiring.Component, source: wiring.Component, names: Iterable[str]) -> None:
    """Set ports of a box to those of the same names of another."""
    drive(m, box, by_name(source, names))


def hand_through(m: Module, outer: wiring.Component, inner: wiring.Component, names: Iterable[str]) -> None:
    """Make ports of an inner box those of the same names of the box around it."""
    for name in names:
        box, source = (inner, outer) if outer.signature.members[name].flow == In else (outer, inner)
        follow(m, box, source, [name])
