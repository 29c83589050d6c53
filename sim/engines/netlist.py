"""The netlist of a core, for studies."""

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from tachometry.hdl.export.files import top_of
from tachometry.hdl.export.verilog import gates_script, netlist_of
from tachometry.spec.control import AnySpec
from tachometry.spec.registers.buses import bus_of


@lru_cache(maxsize=4)
def script(spec: AnySpec, bus: str, baud: int | None, irq: bool) -> str:
    """Return what makes the netlist of a core, with its registers if it is on a bus: equal scripts, equal netlists."""
    return gates_script(top_of(spec, bus_of(bus, baud, irq=irq)))


def netlist(spec: AnySpec, bus: str, baud: int | None, irq: bool) -> Mapping[str, Any]:
    """Return that netlist, see `netlist_of`."""
    return netlist_of(script(spec, bus, baud, irq))
