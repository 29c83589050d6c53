"""All bridges from a bus to the native port share this."""

from amaranth import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out

from tachometry.hdl.bus.native import native_port
from tachometry.hdl.wires.ports import Box, members
from tachometry.spec.registers.buses import BUSES, CAPTURE
from tachometry.spec.registers.map import RegisterMap


class Bridge(Box):
    """From a bus to the native port; `bus` is the name of the bus."""

    bus = ""

    def __init__(self, registers: RegisterMap, **more: wiring.Member) -> None:
        ports = members(port for port in BUSES[self.bus].ports(registers) if port.name != CAPTURE.name)
        super().__init__({**ports, "native": Out(native_port(registers.address_width - 2)), **more})


def next_number(count: Signal) -> Value:
    """Return the number after a count of a few bits, of which each takes a gate; a carry chain takes more."""
    return Cat(bit ^ count[:place].all() if place else ~bit for place, bit in enumerate(count))


class NativeBridge(Bridge):
    """The native port as it is."""

    bus = "native"

    def build(self, m: Module) -> None:
        m.d.comb += [
            self.native.address.eq(self.reg_address),
            self.native.read.eq(self.reg_read),
            self.native.write.eq(self.reg_write),
            self.native.write_data.eq(self.reg_write_data),
            self.reg_read_data.eq(self.native.read_data),
            self.reg_error.eq(self.native.error),
        ]
