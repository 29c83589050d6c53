"""A core of many axes with its registers, on a native port."""

from amaranth import Cat, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.bus.bank import RegisterBank
from tachometry.hdl.bus.interrupts import Interrupts, connect
from tachometry.hdl.bus.native import native_port
from tachometry.hdl.core.axes_tachometer import AxesTachometer
from tachometry.hdl.wires.ports import Box, by_name, drive, follow, members
from tachometry.spec.registers.axes import AxesMap


class AxesRegisterCore(Box):
    """Joins a core of many axes and its registers; see `RegisterCore`."""

    def __init__(self, registers: AxesMap) -> None:
        self._map = registers
        self.tachometer = AxesTachometer(registers.axes)
        self.bank = RegisterBank(registers)
        super().__init__(
            **members(registers.core_ports),
            bus=In(native_port(registers.address_width - 2)),
            capture=In(1),  # captures in every clock in which it is high
        )

    def build(self, m: Module) -> None:
        core, bank, spec = self.tachometer, self.bank, self._map.axes
        m.submodules.tachometer, m.submodules.bank = core, bank
        wiring.connect(m, wiring.flipped(self.bus), bank.bus)
        follow(m, core, self, (port.name for port in spec.ports.pins))
        follow(m, self, core, (port.name for port in spec.ports.outputs))
        follow(m, bank, core, (*(port.name for port in self._map.ports), *self._map.strobes))
        whose = {"updated": (core.velocity_valid, core.axis)}
        if spec.tachometer.index:
            whose["indexed"] = (core.index_valid, core.index_axis)
        axes = range(spec.axes)
        for axis in axes:
            events = {event: strobe & (number == axis) for event, (strobe, number) in whose.items()}
            drive(m, bank, events, f"{{}}_now_{axis}")
        overflows = [overflow & (core.axis == axis) for axis, overflow in by_name(core, axes, "overflow_{}").items()]
        m.d.comb += [bank.capture.eq(self.capture), bank.overflow.eq(Cat(overflows).any())]
        if self._map.irq:
            box = Interrupts(self._map, spec.axes)
            connect(m, box, bank, core)
            m.d.comb += [
                box.ticks.eq(Cat(core.tick & (core.axis == axis) for axis in axes)),
                box.standstill.eq(Cat(by_name(core, axes, "standstill_{}").values())),
                self.irq.eq(box.irq),
            ]
