"""The whole core on a bus."""

from amaranth import Module
from amaranth.lib import wiring

from tachometry.hdl.bus.apb import ApbBridge
from tachometry.hdl.bus.axi_lite import AxiLiteBridge
from tachometry.hdl.bus.bridge import Bridge, NativeBridge
from tachometry.hdl.bus.spi import SpiBridge
from tachometry.hdl.bus.uart import UartBridge
from tachometry.hdl.bus.wishbone import WishboneBridge
from tachometry.hdl.core.axes_registers import AxesRegisterCore
from tachometry.hdl.core.register_core import RegisterCore
from tachometry.hdl.wires.ports import Box, hand_through, members
from tachometry.spec.registers.axes import AxesMap
from tachometry.spec.registers.buses import Bus
from tachometry.spec.registers.map import RegisterMap

# Bridges by the names of their buses.
BRIDGES: dict[str, type[Bridge]] = {
    bridge.bus: bridge for bridge in (NativeBridge, WishboneBridge, ApbBridge, AxiLiteBridge, SpiBridge, UartBridge)
}


def bridge_on(registers: RegisterMap, bus: Bus) -> Bridge:
    """Return the bridge from a bus to these registers; ParameterError if the clock cannot make the bits of the bus."""
    cycles = (bus.bit_cycles(registers.spec.timing.clock_hz),) if bus.baud else ()
    return BRIDGES[bus.name](registers, *cycles)


class BusTachometer(Box):
    """Puts the registers of a tachometer, maybe with a control loop, on a bus.

    It raises ParameterError if the clock cannot make the bits of the bus.
    """

    def __init__(self, registers: RegisterMap, bus: Bus) -> None:
        self.core = AxesRegisterCore(registers) if isinstance(registers, AxesMap) else RegisterCore(registers)
        self.bridge = bridge_on(registers, bus)
        super().__init__(members((*registers.core_ports, *bus.ports(registers))))

    def build(self, m: Module) -> None:
        m.submodules.core = core = self.core
        m.submodules.bridge = bridge = self.bridge
        wiring.connect(m, bridge.native, core.bus)
        for name in self.signature.members:
            hand_through(m, self, bridge if name in bridge.signature.members else core, [name])
