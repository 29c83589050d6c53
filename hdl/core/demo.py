"""The demo puts a tachometer and an emulated encoder on a board."""

from amaranth import Cat, Module, Mux, ResetInserter, Signal
from amaranth.lib import wiring

from tachometry.hdl.bus.telemetry import TelemetrySender
from tachometry.hdl.bus.uart import UartBridge
from tachometry.hdl.core.bus_tachometer import bridge_on
from tachometry.hdl.core.emulated_reads import EmulatedReads
from tachometry.hdl.core.emulator import EncoderEmulator
from tachometry.hdl.core.register_core import RegisterCore
from tachometry.hdl.wires.ports import Box, by_name, drive, follow, hand_through, members
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.language.field import WORD
from tachometry.spec.registers.buses import CAPTURE, Bus
from tachometry.spec.registers.demo import ENCODER_LINES, PERIOD_WIDTH, DemoMap, demo_ports, emulated


class Demo(Box):
    """A tachometer on pins or on an emulated encoder, with its registers on a bus; telemetry if that is a UART.

    The tachometer may have a control loop, whose current is a stream of bits.

    The settings survive a restart, which resets tachometer, loop, emulator and time.

    It raises ParameterError if the clock cannot make the bits of the bus.
    """

    def __init__(self, registers: DemoMap, bus: Bus) -> None:
        spec = registers.spec
        self._map = registers
        self.core = RegisterCore(registers)
        self._lines = [pin.name for pin in spec.ports.pins if pin.name in ENCODER_LINES]
        self.emulator = EncoderEmulator(*emulated(spec))
        self.reads = EmulatedReads(spec) if spec.encoder.sampled else None
        self.bridge = bridge_on(registers, bus)
        self.telemetry: TelemetrySender | None = None
        if isinstance(self.bridge, UartBridge):
            self.telemetry = TelemetrySender(registers, bus.bit_cycles(spec.timing.clock_hz))
        self._bus_ports = [port for port in bus.ports(registers) if port.name != CAPTURE.name]
        super().__init__(members(demo_ports(registers, bus)))

    def build(self, m: Module) -> None:
        m.submodules.core = self.core
        m.submodules.bridge = self.bridge
        m.submodules.emulator = ResetInserter(self.core.bank.restart)(self.emulator)
        period = Signal()
        sends = self._time(m, period)
        self._choose_pins(m, period)
        self._enable(m)
        hand_through(m, self, self.bridge, (port.name for port in self._bus_ports))
        m.d.comb += self.core.capture.eq(self.capture)
        self._native(m, sends)
        self._light(m)

    def _time(self, m: Module, period: Signal) -> Signal:
        """Count clocks and nominal periods, as windows of a core may last for ever; return when telemetry is due."""
        bank = self.core.bank
        cycles = self._map.spec.timing.tick_cycles
        time = Signal(WORD)
        changed = Signal(WORD)  # the time of the last change of a setting
        left = Signal(range(cycles))  # clocks of the period
        periods = Signal(PERIOD_WIDTH)  # since the last telemetry
        sends = Signal()
        m.d.sync += [period.eq(left == 0), left.eq(Mux(left == 0, cycles - 1, left - 1))]
        m.d.sync += time.eq(time + 1)
        with m.If(bank.written):
            m.d.sync += changed.eq(time)
        with m.If(period):
            m.d.comb += sends.eq((bank.telemetry_period != 0) & (periods + 1 >= bank.telemetry_period))
            m.d.sync += periods.eq(Mux(sends, 0, periods + 1))
        with m.If(bank.restart):
            m.d.sync += [signal.eq(0) for signal in (time, changed, left, period, periods)]
        m.d.comb += [bank.time.eq(time), bank.changed.eq(changed)]
        return sends

    def _choose_pins(self, m: Module, period: Signal) -> None:
        """Give the core its pins, or the lines of the emulator and a tick in each period."""
        core, emulator, bank = self.core, self.emulator, self.core.bank
        follow(m, emulator, bank, (field.port for field in self._map.emulated))
        front = self._map.spec.front_end
        pins = by_name(self, (pin.name for pin in self._map.spec.ports.pins if pin.name in self.signature.members))
        lines = by_name(emulator, self._lines)
        if self.reads is not None:
            lines = self._read(m, self.reads)
        for line, whole in by_name(emulator, front.complemented, "{}_n").items():
            drive(m, core, {f"{line}_n": Mux(bank.emulated, whole, ~pins[line])})
        for name, pin in pins.items():
            emulated = pin if name in front.controls else lines.get(name, period)  # the external tick
            if name in lines:
                drive(m, self, {f"emulated_{name}": emulated})
            drive(m, core, {name: Mux(bank.emulated, emulated, pin)})

    def _read(self, m: Module, reads: EmulatedReads) -> dict[str, Signal]:
        """Read the emulated encoder; return the line of one that the core reads itself."""
        core, bank = self.core, self.core.bank
        m.submodules.reads = ResetInserter(bank.restart)(reads)
        follow(m, reads, self.emulator, ("a", "b"))
        if (made := self._map.spec.reads) is None:
            given = by_name(reads, self._map.reads)
            drive(m, core, given | {"sample_valid": reads.sample_valid & bank.emulated})
            return {}
        _, *driven = (port.name for port in made.ports)
        follow(m, reads, core, driven)
        follow(m, self, core, driven)
        return by_name(reads, [made.line])

    def _enable(self, m: Module) -> None:
        """Give the loop its enable, which comes from a pin, and which many flip-flops follow."""
        if self.core.loop is not None:
            enable = Signal()
            m.submodules.sync_enable = Synchronizer(self.enable, enable)
            m.d.comb += [self.core.enable.eq(enable), self.current_pdm.eq(self.core.current_pdm)]

    def _native(self, m: Module, sends: Signal) -> None:
        """Put the bridge and the telemetry on one native port: one of them begins when the other has ended."""
        native, bridge, telemetry = self.core.bus, self.bridge, self.telemetry
        if telemetry is None:
            wiring.connect(m, bridge.native, native)
            return
        m.submodules.telemetry = telemetry
        of_bridge, of_telemetry = bridge.native, telemetry.native
        m.d.comb += [
            telemetry.send.eq(sends),
            telemetry.wait.eq(bridge.occupied),
            bridge.wait.eq(telemetry.busy),
            self.uart_tx.eq(bridge.uart_tx & telemetry.line),
            native.address.eq(Mux(of_telemetry.read, of_telemetry.address, of_bridge.address)),
            native.read.eq(of_bridge.read | of_telemetry.read),
            native.write.eq(of_bridge.write),
            native.write_data.eq(of_bridge.write_data),
            of_bridge.read_data.eq(native.read_data),
            of_bridge.error.eq(native.error),
            of_telemetry.read_data.eq(native.read_data),
        ]

    def _light(self, m: Module) -> None:
        """Light the LEDs: the shaft turns, backward, something went wrong, and the clock runs."""
        core = self.core
        wrong = Signal()
        backward = Signal()
        runs = Signal(range(self._map.spec.timing.clock_hz))
        m.d.sync += wrong.eq((wrong | core.decode_error | (core.tick & core.overflow)) & ~core.bank.clear)
        with m.If(core.velocity_valid):
            m.d.sync += backward.eq(core.velocity < 0)
        m.d.sync += runs.eq(runs + 1)
        m.d.sync += self.leds.eq(Cat(~core.standstill, backward, wrong, runs[-1]))
