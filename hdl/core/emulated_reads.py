"""An absolute encoder that is not there."""

from amaranth import Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.decoder import QuadratureDecoder
from tachometry.hdl.front_end.position_counter import PositionCounter
from tachometry.hdl.wires.ports import Box, drive
from tachometry.spec import TachometerSpec
from tachometry.spec.registers.emulator import READ_AGE


class EmulatedReads(Box):
    """Counts the edges of emulated lines, and reads the count in the last clock of each nominal tick.

    A read is wrong if both lines have changed at once since the read before.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        assert spec.encoder.sampled is not None
        self._cycles = spec.timing.tick_cycles
        reads = {port.name: Out(port.width) for port in spec.encoder.sampled.ports(spec.tick.longest)}
        super().__init__(a=In(1), b=In(1), **reads)

    def build(self, m: Module) -> None:
        m.submodules.decoder = decoder = QuadratureDecoder(4)
        m.submodules.counter = counter = PositionCounter(len(self.sample), latency=READ_AGE)
        left = Signal(range(self._cycles), init=self._cycles - 1)  # clocks to the next read
        wrong = Signal()
        drive(m, decoder, {"level_a": self.a, "level_b": self.b, "ready": 1})
        m.d.comb += [
            counter.step.eq(decoder.step),
            self.sample.eq(counter.position),
            self.sample_valid.eq(left == 0),
            self.sample_ok.eq(~wrong),
        ]
        m.d.sync += [
            left.eq(Mux(self.sample_valid, self._cycles - 1, left - 1)),
            wrong.eq((wrong & ~self.sample_valid) | decoder.decode_error),
        ]
        if "sample_age" in self.signature.members:
            m.d.comb += self.sample_age.eq(READ_AGE)
