"""What all bridges from a bus to the native port share."""

from typing import Any

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.native import native_port
from tachometry.spec.registers.buses import BUSES, CAPTURE
from tachometry.spec.registers.map import RegisterMap


def bridge_members(bus: str, registers: RegisterMap) -> dict[str, Any]:
    """Members of a bridge: the ports that the bus adds to the core, and `native`."""
    flow = {"input": In, "output": Out}
    ports = {
        port.name: flow[port.direction](port.width) for port in BUSES[bus].ports(registers) if port.name != CAPTURE.name
    }
    return {**ports, "native": Out(native_port(registers.address_width - 2))}


def next_number(count: Signal) -> Value:
    """The number after a count of a few bits, of which each takes a gate; a carry chain takes more."""
    return Cat(bit ^ count[:place].all() if place else ~bit for place, bit in enumerate(count))


class NativeBridge(wiring.Component):
    """The native port as it is.

    Parameters
    ----------
    registers : RegisterMap

    Members
    -------
    The ports of the bus, and

    native : Out(native_port)
    """

    def __init__(self, registers: RegisterMap) -> None:
        super().__init__(bridge_members("native", registers))

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.d.comb += [
            *(getattr(self.native, name).eq(getattr(self, f"reg_{name}")) for name in ("address", "read", "write")),
            self.native.write_data.eq(self.reg_write_data),
            self.reg_read_data.eq(self.native.read_data),
            self.reg_error.eq(self.native.error),
        ]
        return m
