"""A core whose encoder is read, in place of one whose edges are counted."""

from amaranth import Module, Mux, Signal, Value
from amaranth.lib import wiring

from tachometry.hdl.core.tachometer import Tachometer
from tachometry.hdl.front_end.conditioner import InputConditioner
from tachometry.hdl.front_end.encoder_master import EncoderMaster
from tachometry.hdl.front_end.pin_rise import PinRise
from tachometry.hdl.front_end.remainder import Remainder
from tachometry.hdl.front_end.sampled_position import SampledPosition
from tachometry.hdl.front_end.sampling_clock import SamplingClock
from tachometry.hdl.front_end.serial_encoder import SerialEncoder
from tachometry.hdl.front_end.spi_encoder import SpiEncoder
from tachometry.hdl.front_end.tformat_encoder import TformatEncoder
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import by_name, drive, follow, hand_through
from tachometry.spec import TachometerSpec
from tachometry.spec.core.chips import SpiReads
from tachometry.spec.core.reads import JUMP, NO_ANSWER, READ_FAULT_BITS, WARNING, WRONG_CHECK, Reads
from tachometry.spec.core.tformat import TformatReads


class SampledTachometer(Tachometer):
    """Takes reads of a position, gives position and velocity; see `Tachometer`."""

    _skipped = ("datapath",)

    def _make_front(self, spec: TachometerSpec) -> None:
        self.reader = SampledPosition(spec)
        self.master = None if spec.reads is None else master_of(spec.reads)
        self.read_fault = Signal(READ_FAULT_BITS)
        self.modulo_counter, self.index_capture = None, None
        self.remainder = None if spec.remainder is None else Remainder(spec.remainder)
        self.position_counter, self.controls = self.reader, {}
        if lines := spec.front_end.lines:  # the preset alone
            self.conditioner = InputConditioner(lines=lines)
            self.controls = {name: PinRise(spec.latency.place) for name in lines}

    @property
    def settable(self) -> tuple[wiring.Component, ...]:
        return (self.reader, *self.extras.values())

    def _place_front(self, m: Module) -> None:
        m.submodules.reader = self.reader
        if self.controls:
            m.submodules.conditioner = self.conditioner

    def _count(self, m: Module) -> dict[str, Value]:
        reader, sampled = self.reader, self._spec.encoder.sampled
        assert sampled is not None
        inputs = [port.name for port in sampled.ports(self._spec.tick.longest)]
        source = self if self.master is None else self._read(m, self.master)
        follow(m, reader, source, inputs)
        wrong, warned = WRONG_CHECK, 0
        if self.master is not None:
            wrong = self.master.reason
            warning = self.master.sample_valid & self.master.sample_warning & ~reader.decode_error
            (warned,) = delay(m, warning, clocks=reader.spent)  # unless it is a jump
        fault = Mux(reader.decode_error, Mux(reader.sample_ok, NO_ANSWER, wrong), Mux(warned, WARNING, 0))
        m.d.comb += self.read_fault.eq(Mux(reader.refused, JUMP, fault))
        drive(m, reader, {"last": self.sampling_clock.last})
        follow(m, self, reader, ("decode_error",))
        shown = ("tick", "pulse_count", "overflow", "position", "position_valid")
        names = ("number", "times", "phase", "forgets", "silent", "elapsed", "length")
        found = by_name(reader, (*shown, *names))
        if self.remainder is not None:
            found = self._wait(m, self.remainder, found)
        elif self._spec.modulus is not None:
            m.d.comb += self.position_modulo.eq(reader.place)
        self.phase = found["phase"]
        drive(m, self, {name: found[name] for name in shown})
        return found

    def _wait(self, m: Module, box: Remainder, given: dict[str, Signal]) -> dict[str, Signal]:
        """Compute `position_modulo`, and return the outputs of the reader, which wait for it."""
        reader = self.reader
        m.submodules.remainder = box
        drive(m, box, {"start": reader.coming, "value": reader.around})
        held = {name: Signal.like(value, name=f"held_{name}") for name, value in given.items()}
        with m.If(box.done):
            m.d.sync += self.position_modulo.eq(box.remainder)
            m.d.sync += [held[name].eq(value) for name, value in given.items()]
        m.d.sync += held["tick"].eq(box.done)
        return held

    def _read(self, m: Module, master: EncoderMaster) -> EncoderMaster:
        """Let the master read once in each tick, so that the answer comes before it ends, or after an external one."""
        m.submodules.master = master
        assert self._spec.reads is not None
        hand_through(m, self, master, (port.name for port in self._spec.reads.ports))
        clock = self.sampling_clock
        m.d.comb += master.start.eq(clock.early if isinstance(clock, SamplingClock) else clock.last)
        return master

    def _taps(self, m: Module) -> dict[str, Value]:
        taps = {"read_fault": self.read_fault, "phase": self.phase, **self._whole(m)}
        if "offset_read" in self.datapath.signature.members:
            taps |= by_name(self.datapath, ("offset_read",))
        return taps


def master_of(reads: Reads) -> EncoderMaster:
    """Return the master that makes these reads."""
    if isinstance(reads, SpiReads):
        return SpiEncoder(reads)
    return TformatEncoder(reads) if isinstance(reads, TformatReads) else SerialEncoder(reads)


def tachometer_of(spec: TachometerSpec) -> Tachometer:
    """Return the core of one axis."""
    return Tachometer(spec) if spec.encoder.sampled is None else SampledTachometer(spec)
