"""A master for absolute encoders with T-format."""

from amaranth import Cat, Const, Module, Mux, Signal, Value

from tachometry.hdl.front_end.encoder_master import EncoderMaster, Frame
from tachometry.spec.core.reads import ERROR_BIT, WRONG_CHECK
from tachometry.spec.core.tformat import CHARACTER, ERRORS, PLACE, REQUEST, STATUS, TURNS, WARNINGS, TformatReads

_STOP = CHARACTER - 1  # place of the stop bit; that of the start bit is 0
_SENT = 0b11 << _STOP | REQUEST << 1  # the request with its start and stop bit, and the level after it


class _Frame(Frame):
    def __init__(self, reads: TformatReads) -> None:
        super().__init__()
        self.time = Signal(range(max(reads.oldest, reads.rest) + 1))  # clocks since the request, then of the rest
        self.at = Signal(range(reads.bit))  # clocks until a bit begins, or is read
        self.beat = self.at == 0
        self.ends = Signal()  # with the stop bit
        self.place = Signal(range(CHARACTER))  # the bit within its character
        self.number = Signal(range(8 * reads.characters + 1))  # of the bit of data
        self.check = Signal(8)
        self.wrong = Signal()  # the answer is not one to the request, or a start or stop bit is wrong
        self.error = Signal()
        self.warning = Signal()


class TformatEncoder(EncoderMaster):
    """Reads a position by T-format; see `TformatReads`. The fall of each start bit tells where bits are read."""

    def __init__(self, reads: TformatReads) -> None:
        self._reads = reads
        super().__init__(reads)

    def build(self, m: Module) -> None:
        reads = self._reads
        frame = _Frame(reads)
        word = Signal(reads.width)
        self._synchronise(m, reads, frame)
        m.d.comb += self.sample.eq(word)
        m.d.sync += [frame.at.eq(Mux(frame.beat, reads.bit - 1, frame.at - 1)), frame.time.eq(frame.time + 1)]
        m.d.comb += frame.ends.eq(frame.beat & (frame.place == _STOP))
        with m.If(frame.beat):
            m.d.sync += frame.place.eq(Mux(frame.ends, 0, frame.place + 1))
        with m.FSM() as machine:
            self._request(m, frame)
            with m.State("WAIT"):
                m.d.sync += [frame.place.eq(0), frame.at.eq(reads.half - 1)]
                with m.If(~frame.line):
                    m.next = "CHARACTER"
                with m.If(frame.time >= reads.last_start):
                    m.d.sync += frame.silent.eq(1)
                    m.next = "DONE"
            with m.State("CHARACTER"), m.If(frame.beat):
                self._take_bit(m, frame, word)
                with m.If(frame.ends):
                    m.next = "WAIT"
                    with m.If(frame.number == 8 * reads.characters):
                        m.next = "DONE"
            with m.State("DONE"):
                m.d.comb += frame.done.eq(1)
                m.d.sync += frame.time.eq(0)
                m.next = "REST"
            with m.State("REST"), m.If(frame.time == reads.rest - 2):
                m.next = "IDLE"
        self._recover(m, machine)
        reason = Mux(frame.wrong | frame.check.any(), WRONG_CHECK, Mux(frame.error, ERROR_BIT, 0))
        self._report(m, frame, reason, frame.warning, frame.time)

    def _request(self, m: Module, frame: _Frame) -> None:
        """Send the request."""
        tx = Signal(init=1)
        de = Signal()
        m.d.comb += [self.rs485_tx.eq(tx), self.rs485_de.eq(de)]
        with m.State("IDLE"):
            m.d.comb += frame.idle.eq(1)
            bits = (frame.place, frame.number, frame.check, frame.silent, frame.wrong, frame.error)
            m.d.sync += [*(each.eq(0) for each in bits), frame.at.eq(self._reads.bit - 1)]
            with m.If(self.start):
                m.d.sync += [tx.eq(0), de.eq(1)]
                m.next = "SEND"
        with m.State("SEND"):
            m.d.sync += frame.time.eq(0)
            with m.If(frame.beat):
                m.d.sync += tx.eq(Const(_SENT >> 1, CHARACTER).bit_select(frame.place, 1))
            with m.If(frame.ends):
                m.d.sync += de.eq(0)
                m.next = "WAIT"

    def _take_bit(self, m: Module, frame: _Frame, word: Signal) -> None:
        """Check a bit of start or stop, or take a bit of data, the lowest first."""
        line, number, turn_bits = frame.line, frame.number, self._reads.turn_bits
        inside, character = number[:3], number[3:]

        def within(first: int, bits: int) -> Value:
            return (number >= 8 * first) & (number < 8 * first + bits)

        with m.If(frame.place == 0):
            m.d.sync += frame.wrong.eq(frame.wrong | line)
        with m.Elif(frame.place == _STOP):
            m.d.sync += frame.wrong.eq(frame.wrong | ~line)
        with m.Else():
            m.d.sync += [number.eq(number + 1), frame.check.eq(Cat(frame.check[1:], frame.check[0] ^ line))]
            with m.If(within(PLACE, len(word) - turn_bits) | within(TURNS, turn_bits)):
                m.d.sync += word.eq(Cat(word[1:], line))
            with m.If((character == 0) & (line != Const(REQUEST, 8).bit_select(inside, 1))):
                m.d.sync += frame.wrong.eq(1)
            with m.If(character == STATUS):
                error, warning = (Const(mask, 8).bit_select(inside, 1) for mask in (ERRORS, WARNINGS))
                m.d.sync += frame.error.eq(frame.error | (line & error))
                with m.If(warning):
                    m.d.sync += frame.warning.eq(line)
