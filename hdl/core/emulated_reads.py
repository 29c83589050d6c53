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
from tachometry.spec.core.chips import POSITION_BITS, SpiReads
from tachometry.spec.core.reads import Reads, remainders
from tachometry.spec.core.tformat import IDENTITY, MOST_BITS, REQUEST, TformatReads
from tachometry.spec.registers.emulator import READ_AGE


class EmulatedReads(Box):
    """Counts the edges of emulated lines, and gives the count as a read in the last clock of each nominal tick, or as
    the answer of an encoder that the core reads.

    A read is wrong if both lines have changed at once since the read before; SSI and amt22 do not show that. The line
    of an encoder follows the lines of the core a clock and the delay of the line later.
    """

    def __init__(self, spec: TachometerSpec) -> None:
        assert spec.encoder.sampled is not None
        self._cycles, self._reads, self._width = spec.timing.tick_cycles, spec.reads, spec.encoder.sampled.width
        ports = self._reads.ports if self._reads else spec.encoder.sampled.ports(spec.tick.longest)
        flows = {port.name: (Out if port.direction == "input" else In)(port.width) for port in ports}
        super().__init__(a=In(1), b=In(1), **flows)

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
        """Answer requests; return when the position is taken."""
        if isinstance(reads, SpiReads):
            frame = _word(reads, place, wrong)
            (rises, falls), (ends, begins) = _edges(m, self.spi_sck), _edges(m, self.spi_cs_n)
            taken, shifts = ends if reads.late else begins, rises if reads.facts.falling else falls
        elif isinstance(reads, TformatReads):
            frame = _characters(reads, place, wrong)
            _, taken = _edges(m, self.rs485_de)
            left = Signal(range(max(reads.pause, reads.bit)))  # clocks until a bit begins
            shifts = left == 0
            m.d.sync += left.eq(Mux(taken, reads.pause - 1, Mux(shifts, reads.bit - 1, left - 1)))
        else:
            return self._answer_clock(m, reads, place, wrong)
        word = Signal(len(frame), init=-1)
        line = Signal(init=1)
        m.d.sync += word.eq(Mux(taken, frame, Mux(shifts, Cat(word[1:], 1), word)))
        m.d.comb += line.eq(word[0])
        drive(m, self, {reads.line: delay(m, line, clocks=reads.delay)[0]})
        return taken

    def _answer_clock(self, m: Module, reads: Reads, place: Value, wrong: Value) -> Value:
        """Shift a frame of SSI or BiSS-C onto the line; return when the position is taken."""
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


def _edges(m: Module, line: Value) -> tuple[Value, Value]:
    """Return when a line rises, also as it begins, and when it falls."""
    before = Signal()
    m.d.sync += before.eq(line)
    return line & ~before, ~line & before


def _word(reads: SpiReads, place: Value, wrong: Value) -> Value:
    """Return the bits that a chip sends, the lowest first; before those of a late chip comes the level of the line."""
    place = Cat(C(0, POSITION_BITS - reads.width), place)
    if reads.late:
        return Cat(1, place.xor() ^ wrong, wrong, place[::-1])
    return Cat(~place[1::2].xor(), ~place[::2].xor(), place[::-1])


def _characters(reads: TformatReads, place: Value, wrong: Value) -> Value:
    """Return the level of the line before an answer, and the bits of the answer, the lowest of which is sent first."""
    bits = reads.width - reads.turn_bits
    own, turns = (Cat(part, C(0, MOST_BITS - len(part))) for part in (place[:bits], place[bits:]))
    data = Cat(C(REQUEST, 8), C(0, 4), wrong, C(0, 3), own, C(IDENTITY, 8), turns, C(0, 8))
    each = [data.word_select(number, 8) for number in range(reads.characters - 1)]
    return Cat(1, *(Cat(0, one, 1) for one in (*each, reduce(xor, each))))


def _frame(reads: Reads, place: Value, wrong: Value) -> Value:
    """Return the bits of an answer, of which the highest is sent first."""
    place = place ^ (place >> 1) if reads.gray else place
    if not reads.biss:
        return Cat(0, place).replicate(1 + reads.repeat)
    covered = Cat(1, ~wrong, place)
    terms = zip(covered, remainders(reads.crc or 1, len(covered)), strict=True)
    check = reduce(xor, (bit.replicate(reads.crc_width) & term for bit, term in terms))
    return Cat(0, ~check[: reads.crc_width], covered, C(0b010, 3))
