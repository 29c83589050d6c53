"""A component for Platform Designer of Quartus: `_hw.tcl`."""

from collections.abc import Mapping

from tachometry.hdl.export.render import render_files
from tachometry.spec.control import AnySpec
from tachometry.spec.language.port import STREAM, arranged
from tachometry.spec.registers.buses import Bus, ports_on, registers_on

_KINDS = {"s_axi": "axi4lite", "s_apb": "apb", STREAM: "axi4stream"}
_NAMES = {"axi-lite": "s_axi", "apb": "s_apb"}
BUSES = (*_NAMES, "none")
FILES = ("NAME_hw.tcl",)


def quartus(spec: AnySpec, name: str, bus: Bus | None, made: Mapping[str, str]) -> dict[str, str]:
    """Return the component, which names the Verilog and the constraints beside it, as `Target.files` says."""
    ports = arranged(ports_on(spec, bus))
    there = [_NAMES[bus.name]] if bus else []
    there += [STREAM] * bool(spec.tachometer.ports.streamed)
    roles = {
        port.name: (one, port.name.removeprefix(f"{one}_"))
        for one in there
        for port in ports
        if port.name.startswith(f"{one}_")
    }
    roles |= {"clk": ("clk", "clk"), "rst": ("rst", "reset")}
    irq = bus is not None and registers_on(spec, bus).irq
    roles |= {"irq": ("irq", "irq")} if irq else {}
    return render_files(
        FILES,
        name,
        method=spec.tachometer.method,
        kinds={one: _KINDS[one] for one in there},
        memory=there[0] if bus else "",
        irq=irq,
        # All that is on no bus and no stream is a conduit.
        roles=[(port, *roles.get(port.name, ("pins", port.name))) for port in ports],
        clock_hz=spec.timing.clock_hz,
    )
