"""A master for absolute encoders with SSI or BiSS-C."""

from amaranth import Cat, Module, Mux, Signal, Value

from tachometry.hdl.front_end.encoder_master import EncoderMaster, Frame
from tachometry.spec.core.reads import ERROR_BIT, SYNCHRONISER, WRONG_CHECK, Reads


class _Frame(Frame):
    def __init__(self, reads: Reads) -> None:
        super().__init__()
        self.time = Signal(range(max(reads.oldest, reads.rest) + 1))  # clocks of the read, then of the rest
        self.at = Signal(range(2 * reads.half))  # clocks until a bit is read
        self.beat = self.at == 0
        self.left = Signal(range(reads.frame_bits))  # bits of the frame after this one
        self.past = Signal()  # the bit before, of Gray code decoded
        self.flags = Signal(2, init=3)  # nW, nE
        self.check = Signal(max(reads.crc_width, 1))
        self.unequal = Signal()  # the second reading differs from the first, or CDS is not low
        self.second = Signal()
        self.rests = Signal()


class SerialEncoder(EncoderMaster):
    """Reads a position by SSI or BiSS-C; see `Reads`.

    The encoder shifts at rises of its clock. Of SSI each bit is read half a period and the delay of the line after its
    rise. Of BiSS-C the middle of the bits is found by the first fall of the data. The clock runs until the last bit is
    read.
    """

    def __init__(self, reads: Reads) -> None:
        self._reads = reads
        super().__init__(reads)

    def build(self, m: Module) -> None:
        frame, reads = _Frame(self._reads), self._reads
        self._synchronise(m, reads, frame)
        m.d.sync += [frame.at.eq(Mux(frame.beat, 2 * reads.half - 1, frame.at - 1)), frame.time.eq(frame.time + 1)]
        self._run_clock(m, frame)
        with m.FSM() as machine:
            with m.State("IDLE"):
                m.d.comb += frame.idle.eq(1)
                m.d.sync += [
                    *(each.eq(0) for each in (frame.past, frame.second, frame.unequal, frame.check)),
                    frame.left.eq(reads.frame_bits - 1),
                    frame.silent.eq(~frame.line),
                    frame.time.eq(1 - reads.taken),
                ]
                with m.If(self.start):
                    m.next = "ANSWER"
            self._await_frame(m, frame)
            with m.State("FRAME"), m.If(frame.beat):
                self._take_bit(m, frame)
            with m.State("DONE"):
                m.d.comb += frame.done.eq(1)
                m.d.sync += frame.time.eq(0)
                m.next = "REST"
            with m.State("REST"):
                m.d.comb += frame.rests.eq(1)
                with m.If(frame.time == reads.rest - 2):
                    m.next = "IDLE"
        self._recover(m, machine)
        wrong: Value = frame.unequal
        if reads.crc:
            wrong |= frame.check != self._reads.residue
        reason = Mux(wrong, WRONG_CHECK, Mux(~frame.flags[1], ERROR_BIT, 0))
        self._report(m, frame, reason, ~frame.flags[0], frame.time)

    def _run_clock(self, m: Module, frame: _Frame) -> None:
        """Let the clock fall at the start, and stop it at a rise."""
        last = self._reads.half - 1
        phase = Signal(range(last + 1), init=last)
        ck = Signal(init=1)
        m.d.comb += self.encoder_clock.eq(ck)
        m.d.sync += phase.eq(Mux(phase == 0, last, phase - 1))
        with m.If(phase == 0):
            m.d.sync += ck.eq(~ck | frame.rests)
        with m.If(frame.idle):
            m.d.sync += [ck.eq(~self.start), phase.eq(last)]

    def _await_frame(self, m: Module, frame: _Frame) -> None:
        """Find the middle of the bits, and the first one of the position."""
        reads = self._reads
        if not reads.biss:
            with m.State("ANSWER"), m.If(frame.time == reads.delay + SYNCHRONISER):
                m.d.sync += frame.at.eq(2 * reads.half - 1)
                m.next = "FRAME"
            return
        late = frame.time == reads.start_wait
        with m.State("ANSWER"):
            with m.If(~frame.line):
                m.d.sync += frame.at.eq(reads.half - 1)
                m.next = "START"
            self._give_up(m, frame, late)
        with m.State("START"):
            with m.If(frame.beat & frame.line):
                m.next = "CDS"
            self._give_up(m, frame, late)
        with m.State("CDS"), m.If(frame.beat):
            m.d.sync += frame.unequal.eq(frame.line)
            m.next = "FRAME"

    def _give_up(self, m: Module, frame: _Frame, late: Value) -> None:
        with m.If(late):
            m.d.sync += frame.silent.eq(1)
            m.next = "DONE"

    def _take_bit(self, m: Module, frame: _Frame) -> None:
        """Shift a bit into the position, the flags or the check."""
        reads, left, word = self._reads, frame.left, self.sample
        plain = frame.line ^ (frame.past & int(reads.gray))
        m.d.sync += [left.eq(left - 1), frame.past.eq(plain)]
        with m.If(left >= reads.tail_bits):
            differs = frame.second & (plain ^ word[-1])
            m.d.sync += [word.eq(Cat(plain, word)), frame.unequal.eq(frame.unequal | differs)]
        if reads.biss:
            with m.If(left >= reads.crc_width):
                m.d.sync += frame.flags.eq(Cat(frame.line, frame.flags))
        if reads.crc:
            fed = (frame.check[-1] ^ frame.line).replicate(reads.crc_width)
            m.d.sync += frame.check.eq((frame.check << 1) ^ (fed & reads.crc))
        with m.If(left == 0):
            m.next = "DONE"
            if not reads.biss:
                m.d.sync += frame.silent.eq(frame.silent | frame.line)
            if reads.repeat:
                m.d.sync += [frame.second.eq(1), left.eq(reads.frame_bits - 1), frame.past.eq(0)]
                with m.If(~frame.second):
                    m.next = "FRAME"
