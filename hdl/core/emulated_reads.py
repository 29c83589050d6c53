"""An absolute encoder that is not there."""

from functools import reduce
from operator import xor

from amaranth import C, Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Out

from tachometry.hdl.front_end.decoder import QuadratureDecoder
from tachometry.hdl.front_end.position_counter import PositionCounter
from tachometry.hdl.wires.delay import delay
from tachometry.hdl.wires.ports import Box, drive
from tachometry.spec import TachometerSpec
from tachometry.spec.core.reads import Reads, remainders
from tachometry.spec.registers.emulator import READ_AGE


class EmulatedReads(Box):
    """Counts the edges of emulated lines, and gives the count as a read in the last clock of each nominal tick, or as
    the answer of an encoder with SSI or BiSS-C.

    A read is wrong if both lines have changed at once since the read before; SSI does not show that. The line of an
    encoder follows the rises of its clock a clock and the delay of the line later.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        assert spec.encoder.sampled is not None
        self._cycles, self._reads, self._width = spec.timing.tick_cycles, spec.reads, spec.encoder.sampled.width
        ports = spec.encoder.sampled.ports(spec.tick.longest)
        sampled = {port.name: Out(port.width) for port in ports}
        lines = {"encoder_clock": In(1), "encoder_data": Out(1)}
        super().__init__(a=In(1), b=In(1), **(lines if self._reads else sampled))

    def build(self, m: Module) -> None:
        m.submodules.decoder = decoder = QuadratureDecoder(4)
        m.submodules.counter = counter = PositionCounter(self._width, latency=READ_AGE)
        drive(m, decoder, {"level_a": self.a, "level_b": self.b, "ready": 1})
        m.d.comb += counter.step.eq(decoder.step)
        wrong = Signal()
        place = counter.position.as_unsigned()
        taken = self._give(m, place, wrong) if self._reads is None else self._answer(m, self._reads, place, wrong)
        m.d.sync += wrong.eq((wrong & ~taken) | decoder.decode_error)

    def _give(self, m: Module, place: Value, wrong: Value) -> Value:
        """Read at the end of each tick; return when."""
        left = Signal(range(self._cycles), init=self._cycles - 1)  # clocks to the next read
        m.d.comb += [self.sample.eq(place), self.sample_valid.eq(left == 0), self.sample_ok.eq(~wrong)]
        m.d.sync += left.eq(Mux(self.sample_valid, self._cycles - 1, left - 1))
        if "sample_age" in self.signature.members:
            m.d.comb += self.sample_age.eq(READ_AGE)
        return self.sample_valid

    def _answer(self, m: Module, reads: Reads, place: Value, wrong: Value) -> Value:
        """Shift a frame onto the line; return when the position is taken."""
        frame = _frame(reads, place, wrong)
        word = Signal(len(frame))
        line, idle, before = (Signal(init=1, name=name) for name in ("line", "idle", "before"))
        last = (reads.rest + 2 * reads.half) // 2
        still = Signal(range(last + 1))  # clocks since a rise
        rises, falls = self.encoder_clock & ~before, ~self.encoder_clock & before
        taken = idle & (rises if reads.biss else falls)
        m.d.sync += [before.eq(self.encoder_clock), still.eq(Mux(rises | (still == last), 0, still + 1))]
        with m.If(taken):
            m.d.sync += [word.eq(frame), idle.eq(0)]
        with m.Elif(rises):
            m.d.sync += [word.eq(word << 1), line.eq(word[-1])]
        with m.Elif(still == last):
            m.d.sync += [line.eq(1), idle.eq(1)]
        m.d.comb += self.encoder_data.eq(*delay(m, line, clocks=reads.delay))
        return taken


def _frame(reads: Reads, place: Value, wrong: Value) -> Value:
    """Return the bits of an answer, of which the highest is sent first."""
    place = place ^ (place >> 1) if reads.gray else place
    if not reads.biss:
        return Cat(0, place).replicate(1 + reads.repeat)
    covered = Cat(1, ~wrong, place)
    terms = zip(covered, remainders(reads.crc or 1, len(covered)), strict=True)
    check = reduce(xor, (bit.replicate(reads.crc_width) & term for bit, term in terms))
    return Cat(0, ~check[: reads.crc_width], covered, C(0b010, 3))
