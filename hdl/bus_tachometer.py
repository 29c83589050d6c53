"""The whole core on a bus."""

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.apb import ApbBridge
from tachometry.hdl.bus.axi_lite import AxiLiteBridge
from tachometry.hdl.bus.bridge import NativeBridge
from tachometry.hdl.bus.spi import SpiBridge
from tachometry.hdl.bus.uart import UartBridge
from tachometry.hdl.bus.wishbone import WishboneBridge
from tachometry.hdl.register_core import RegisterCore
from tachometry.spec.registers.buses import bus_of
from tachometry.spec.registers.map import RegisterMap

# Bridges by the names of their buses.
BRIDGES: dict[str, type[wiring.Component]] = {
    "native": NativeBridge,
    "wishbone": WishboneBridge,
    "apb": ApbBridge,
    "axi-lite": AxiLiteBridge,
    "spi": SpiBridge,
    "uart": UartBridge,
}


class BusTachometer(wiring.Component):
    """A tachometer with its registers on a bus.

    Parameters
    ----------
    registers : RegisterMap
    bus : str
        One of `spec.registers.buses.BUSES`.
    baud : int or None
        Bits a second of a bus that has them; None: its default.

    Members
    -------
    The ports of the spec, less `clk` and `rst`, and those of the bus.

    Raises
    ------
    ParameterError
        If there is no such bus, or the clock cannot make its bits.
    """

    def __init__(self, registers: RegisterMap, bus: str, baud: int | None = None) -> None:
        self.core = RegisterCore(registers)
        on = bus_of(bus, baud)
        assert on is not None
        self.bridge = BRIDGES[bus](registers, *((on.bit_cycles(registers.spec.timing.clock_hz),) if on.baud else ()))
        own = {name: member for name, member in self.core.signature.members.items() if name not in ("bus", "capture")}
        flow = {"input": In, "output": Out}
        super().__init__({**own, **{port.name: flow[port.direction](port.width) for port in on.ports(registers)}})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.core = core = self.core
        m.submodules.bridge = bridge = self.bridge
        wiring.connect(m, bridge.native, core.bus)
        for name, member in self.signature.members.items():
            inner = getattr(bridge if name in bridge.signature.members else core, name)
            own = getattr(self, name)
            m.d.comb += inner.eq(own) if member.flow == In else own.eq(inner)
        return m
