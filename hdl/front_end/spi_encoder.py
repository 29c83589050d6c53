"""A master for absolute encoders with SPI."""

from amaranth import Cat, Module, Mux, Signal, Value

from tachometry.hdl.front_end.encoder_master import EncoderMaster, Frame
from tachometry.spec.core.chips import POSITION_BITS, WORD_BITS, SpiReads
from tachometry.spec.core.reads import ERROR_BIT, SYNCHRONISER, WRONG_CHECK


class _Frame(Frame):
    def __init__(self, longest: int) -> None:
        super().__init__()
        self.at = Signal(range(longest))  # clocks of what the lines do
        self.beat = self.at == 0
        self.left = Signal(range(WORD_BITS + 1))  # bits that are still to be read
        self.word = Signal(POSITION_BITS + 1)  # the position, and the bit before it
        self.odd = Signal(2)  # whether ones are odd among every other bit, and among those between
        self.sck = Signal()
        self.cs_n = Signal(init=1)


class SpiEncoder(EncoderMaster):
    """Reads a position by SPI; see `SpiReads`.

    A period of the clock begins with its rise. Of mode 1 its middle, when the clock falls, is where a bit is read, of
    mode 0 its begin, each later by the delay of the line.
    """

    def __init__(self, reads: SpiReads) -> None:
        self._reads = reads
        super().__init__(reads)

    def build(self, m: Module) -> None:
        reads = self._reads
        frame = _Frame(max(reads.setup, 2 * reads.half, reads.rest))
        self._synchronise(m, reads, frame)
        m.d.comb += [self.spi_sck.eq(frame.sck), self.spi_cs_n.eq(frame.cs_n)]
        m.d.sync += frame.at.eq(frame.at - 1)
        with m.FSM() as machine:
            with m.State("IDLE"):
                m.d.comb += frame.idle.eq(1)
                m.d.sync += [frame.at.eq(reads.setup - 1), frame.left.eq(WORD_BITS), frame.odd.eq(0)]
                with m.If(self.start):
                    m.d.sync += frame.cs_n.eq(0)
                    m.next = "SETUP"
            with m.State("SETUP"), m.If(frame.beat):
                m.d.sync += [frame.at.eq(2 * reads.half - 1), frame.sck.eq(1)]
                m.next = "BIT"
                with m.If(frame.left == 0):
                    m.d.sync += [frame.sck.eq(0), frame.cs_n.eq(1)]
                    m.next = "DONE"
            with m.State("BIT"):
                self._read_bit(m, frame)
            with m.State("DONE"):
                m.d.comb += frame.done.eq(1)
                m.d.sync += frame.at.eq(reads.rest - 2)
                m.next = "REST"
            with m.State("REST"), m.If(frame.beat):
                m.next = "IDLE"
        self._recover(m, machine)
        wrong, age = ~frame.odd.all(), Value.cast(reads.oldest)
        error = Value.cast(0)
        if reads.late:
            wrong, age = frame.odd.xor(), self._time_answers(m, frame)
            error = self._command(m, frame)
        else:
            m.d.comb += self.spi_mosi.eq(0)
        m.d.comb += self.sample.eq(frame.word[POSITION_BITS - reads.width : POSITION_BITS])
        self._report(m, frame, Mux(wrong, WRONG_CHECK, Mux(error, ERROR_BIT, 0)), Value.cast(0), age)

    def _read_bit(self, m: Module, frame: _Frame) -> None:
        reads = self._reads
        read = 2 * reads.half - 1 - reads.half * reads.facts.falling - reads.delay - SYNCHRONISER
        with m.If(frame.at == reads.half):
            m.d.sync += frame.sck.eq(0)
        with m.If(frame.at == read):
            m.d.sync += [
                frame.word.eq(Cat(frame.line, frame.word)),
                frame.odd.eq(Cat(frame.odd[1] ^ frame.line, frame.odd[0])),
            ]
        with m.If(frame.beat):
            m.d.sync += [frame.left.eq(frame.left - 1), frame.at.eq(2 * reads.half - 1), frame.sck.eq(1)]
            ends = frame.left == 1
            if reads.facts.bytewise:
                ends |= frame.left == WORD_BITS // 2 + 1
            with m.If(ends):
                m.d.sync += [frame.at.eq(reads.setup - 1), frame.sck.eq(0)]
                m.next = "SETUP"

    def _time_answers(self, m: Module, frame: _Frame) -> Value:
        """Return the age of a late answer, which was taken at the end of the frame before."""
        age = Signal(self._reads.age_width, init=-1)
        m.d.sync += age.eq(Mux(frame.done, 1, age + ~age.all()))
        return age

    def _command(self, m: Module, frame: _Frame) -> Value:
        """Send commands, return whether an answer has the error bit or is to the command that clears it."""
        command, clear = self._reads.facts.command, self._reads.facts.clear
        clears = Signal()  # the command of this frame clears the error bit
        cleared = Signal()  # that of the frame before did
        error = frame.word[POSITION_BITS] | cleared
        bits = [bit + 1 for bit in range(WORD_BITS) if clear >> bit & 1]
        assert command == (1 << WORD_BITS) - 1
        m.d.comb += self.spi_mosi.eq(~clears | Cat(frame.left == bit for bit in bits).any())
        with m.If(frame.done):
            m.d.sync += [cleared.eq(clears), clears.eq((self.reason == ERROR_BIT) & ~clears & ~cleared)]
        return error
