"""The whole core with registers, on a native port."""

from collections.abc import Iterable

from amaranth import Cat, Module, Mux, ResetInserter, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from tachometry.hdl.bus.bank import RegisterBank
from tachometry.hdl.bus.interrupts import Interrupts, connect
from tachometry.hdl.bus.native import native_port
from tachometry.hdl.bus.tick_position import TickPosition
from tachometry.hdl.core.loop_core import LoopCore
from tachometry.hdl.core.sampled_tachometer import tachometer_of
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.hdl.wires.delay import held_with
from tachometry.hdl.wires.ports import Box, by_name, drive, follow, members
from tachometry.spec.language.port import UPDATE
from tachometry.spec.registers.loop import LoopMap
from tachometry.spec.registers.map import RegisterMap

_MODULO = "position_modulo"
_AT_TICK = {"position", _MODULO}


class RegisterCore(Box):
    """Joins a tachometer, maybe with a control loop, and its registers."""

    def __init__(self, registers: RegisterMap) -> None:
        self._map = registers
        self.loop = LoopCore(registers.loop) if isinstance(registers, LoopMap) else None
        self.tachometer = tachometer_of(registers.spec) if self.loop is None else self.loop.tachometer
        self.bank = RegisterBank(registers)
        super().__init__(
            **members(registers.core_ports),
            bus=In(native_port(registers.address_width - 2)),
            capture=In(1),  # captures in every clock in which it is high
        )

    def build(self, m: Module) -> None:
        spec = self._map.spec
        core, bank = self.tachometer, self.bank
        whole = core if self.loop is None else self.loop
        # Long windows saturate what has been counted since the tick, and what sets the position is not in it.
        counted = not (spec.facts.own_ticks or spec.front_end.moves_position)
        open_sum = core.pulse_counter.open_sum if counted else None
        position = TickPosition(spec.position_width, 0 if open_sum is None else len(open_sum))
        restarts = ResetInserter(bank.restart) if hasattr(bank, "restart") else lambda box: box
        m.submodules.tachometer, m.submodules.tick_position = restarts(whole), restarts(position)
        m.submodules.bank = bank
        names = {port.name for port in self._map.ports} - _AT_TICK  # that of the latest tick is captured
        wiring.connect(m, wiring.flipped(self.bus), bank.bus)
        written = {field.port for field in self._map.settings}
        for pin in self._map.core.ports.pins:
            given = getattr(bank if pin.name in written else self, pin.name)
            switched = given & bank.loop_enable if pin.name == "enable" else given
            m.d.comb += getattr(whole, pin.name).eq(switched)
        follow(m, self, whole, (port.name for port in self._map.core.ports.outputs if port.name != _MODULO))
        follow(m, self, whole, (port.name for port in spec.ports.streamed))
        follow(m, bank, whole, (port.name for port in spec.ports.outputs if port.name in names))
        follow(m, bank, whole, spec.ports.strobes)
        if spec.whole != UPDATE:
            self._hold(m, whole, spec.whole, spec.ports.strobes[UPDATE])
        drive(m, position, {"tick": core.tick, "position": core.position})
        drive(m, bank, {"capture": self.capture, "position": position.latest})
        self._place(m)
        for box in core.settable:
            settings = {"clear", *written} & box.signature.members.keys() - core.signature.members.keys()
            follow(m, box, bank, sorted(settings))
        if self.loop is not None:
            self._keep(m, self.loop)
        if self._map.irq:
            self._interrupt(m, whole)
        if open_sum is not None:
            drive(m, position, {"next": core.position_counter.next, "open_sum": open_sum})

    def _interrupt(self, m: Module, whole: Tachometer | LoopCore) -> None:
        """Raise the interrupt by events of the core and of its extras."""
        core, spec, box = self.tachometer, self._map.spec, Interrupts(self._map)
        connect(m, box, self.bank, whole)
        drive(m, box, {"ticks": getattr(whole, spec.facts.rests_with), "standstill": whole.standstill})
        m.d.comb += self.irq.eq(box.irq)
        for extra in spec.extras:
            for name, event in extra.events(spec).items():
                gates = core if event.wires[0] in core.signature.members else core.extras[extra.name]
                drive(m, box, {name: Cat(by_name(gates, event.wires).values()).any()})

    def _place(self, m: Module) -> None:
        """Let a program set the position, arm the index, and move the place within a modulus."""
        core, bank, modulus = self.tachometer, self.bank, self._map.spec.modulus
        for name, box in core.controls.items():
            m.d.comb += box.asked.eq(getattr(bank, f"{name}_now"))
        if "preset" in core.controls:
            m.d.comb += core.position_counter.value.eq(bank.preset_value)
        if self._map.spec.remainder is not None:  # it is as it was with the latest tick
            for box in (self, bank):
                follow(m, box, core, [_MODULO])
        elif modulus is not None:
            counts, _ = modulus.as_integer_ratio()
            total = core.position_modulo + (bank.modulo_offset if self._map.spec.front_end.shifted_modulus else 0)
            latest = Signal.like(self.position_modulo)
            kept = Signal.like(self.position_modulo)
            m.d.comb += [
                self.position_modulo.eq(Mux(total >= counts, total - counts, total)),
                latest.eq(Mux(core.tick, self.position_modulo, kept)),
                bank.position_modulo.eq(latest),
            ]
            m.d.sync += kept.eq(latest)

    def _keep(self, m: Module, loop: LoopCore) -> None:
        """Keep what a program changes as it was with its strobe, whenever it is captured."""
        own = self._map.spec.ports.strobes
        for strobe, names in self._map.core.ports.strobes.items():
            self._hold(m, loop, strobe, (name for name in names if name not in own.get(strobe, ())))

    def _hold(self, m: Module, whole: Tachometer | LoopCore, strobe: str, names: Iterable[str]) -> None:
        clear = getattr(self.bank, "restart", None)
        drive(m, self.bank, held_with(m, getattr(whole, strobe), by_name(whole, names), clear))
