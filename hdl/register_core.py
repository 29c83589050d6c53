"""The whole core with registers, on a native port."""

from amaranth import Module, ResetInserter
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.bus.bank import RegisterBank
from tachometry.hdl.bus.native import native_port
from tachometry.hdl.bus.tick_position import TickPosition
from tachometry.hdl.tachometer import Tachometer
from tachometry.spec.registers.map import RegisterMap

_OTHERWISE = ("position", "age")  # ports that the bank shows as they were at the latest tick, or are with it


class RegisterCore(wiring.Component):
    """A tachometer with its registers.

    Parameters
    ----------
    registers : RegisterMap

    Members
    -------
    The ports of the spec, less `clk` and `rst`, and

    bus : In(native_port)
    capture : In(1)
        Captures in every clock in which it is high.
    """

    def __init__(self, registers: RegisterMap) -> None:
        self._map = registers
        self.tachometer = Tachometer(registers.spec)
        self.bank = RegisterBank(registers)
        super().__init__(
            {
                **self.tachometer.signature.members,
                "bus": In(native_port(registers.address_width - 2)),
                "capture": In(1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        spec = self._map.spec
        core, bank = self.tachometer, self.bank
        # Long windows saturate what has been counted since the tick, and an index that resets is not in it.
        counted = not (spec.own_ticks or spec.index_reset)
        open_sum = core.pulse_counter.open_sum if counted else None
        position = TickPosition(spec.position_width, 0 if open_sum is None else len(open_sum))
        restarts = ResetInserter(bank.restart) if hasattr(bank, "restart") else lambda box: box
        m.submodules.tachometer, m.submodules.tick_position = restarts(core), restarts(position)
        m.submodules.bank = bank
        outputs = {port.name for port in spec.outputs} - {*_OTHERWISE}
        same = [*(port.name for port in self._map.ports if port.name in outputs), *spec.strobes]
        wiring.connect(m, wiring.flipped(self.bus), bank.bus)
        m.d.comb += [
            *(getattr(core, pin.name).eq(getattr(self, pin.name)) for pin in spec.pins),
            *(getattr(self, port.name).eq(getattr(core, port.name)) for port in spec.outputs),
            *(getattr(bank, name).eq(getattr(core, name)) for name in same),
            bank.capture.eq(self.capture),
            core.conditioner.clear.eq(bank.clear),
            position.tick.eq(core.tick),
            position.position.eq(core.position),
            bank.position.eq(position.latest),
        ]
        if core.update_age is not None:
            m.d.comb += bank.age.eq(core.update_age.after)
        if open_sum is not None:
            m.d.comb += [position.next.eq(core.position_counter.next), position.open_sum.eq(open_sum)]
        return m
