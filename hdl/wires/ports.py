"""Ports of the exported core as members of a component."""

from collections.abc import Iterable
from typing import Any

from amaranth import signed
from amaranth.lib.wiring import In, Out

from tachometry.spec import Port

_FLOW = {"input": In, "output": Out}


def members(ports: Iterable[Port]) -> dict[str, Any]:
    """Return members by the names of the ports, less clock and reset, which are those of the domain."""
    return {
        port.name: _FLOW[port.direction](signed(port.width) if port.signed else port.width)
        for port in ports
        if port.name not in ("clk", "rst")
    }
