"""A bridge answers frames of a UART from the bank of registers."""

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.bridge import Bridge, next_number
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.language.field import WORD
from tachometry.spec.registers.frames import (
    COUNT_WIDTH,
    CRC_POLYNOMIAL,
    CRC_START,
    CRC_WIDTH,
    FROM_CORE,
    QUIET_BITS,
    TYPE_LOW,
    UART_ADDRESS_WIDTH,
)
from tachometry.spec.registers.map import RegisterMap

_STOP = 9  # place of the stop bit; that of the start bit is 0
# Parts of a frame. In place of the address an answer has its status.
_HEADER, _ADDRESS, _DATA, _CHECK = range(4)


class _Characters:
    """Holds the signals of the character that is received or sent."""

    def __init__(self, cycles: int) -> None:
        self.line = Signal()  # the input, synchronised
        self.timer = Signal(range(cycles))  # clocks until the next beat
        self.place = Signal(range(QUIET_BITS))  # the bit within the character, or how long the line has been quiet
        self.beat = Signal()  # a bit is to be sampled, or to begin
        self.receiving = Signal()
        self.sending = Signal()
        self.busy = Signal()
        self.bit_there = Signal()  # a bit of data, not of start or stop
        self.ended = Signal()  # the stop bit
        self.due = Signal()  # an answer waits


class _Frame:
    """Holds the signals of the frame that is received or sent."""

    def __init__(self) -> None:
        self.part = Signal(2)
        self.number = Signal(2)  # of the character within the part
        self.header = Signal(8)
        self.address = Signal(UART_ADDRESS_WIDTH)
        self.count = Signal(COUNT_WIDTH)  # words that are still to be read
        self.word = Signal(WORD)
        self.check = Signal(CRC_WIDTH)
        self.bad = Signal()  # what has come is no request
        self.error = Signal()  # the status of an answer
        self.asked = Signal()  # the native port answers in this clock
        self.answered = Signal()  # an answer begins
        self.more = Signal()  # words are still to be sent
        self.right = Signal()  # a request is whole, and its check is
        self.out = Signal()  # the bit that is sent
        self.bit = Signal()  # the bit that is sent or received
        self.wrong = Signal()  # it is not that of the check
        self.in_header, self.in_address, self.in_data, self.in_check = (self.part == one for one in range(4))
        self.writing = self.header[TYPE_LOW]
        self.word_ends = self.in_data & (self.number == 3)
        self.done = self.in_check & self.number[0]


class UartBridge(Bridge):
    """Answers a UART, 8 bits without parity, with the frames that `spec.registers.frames` describes.

    A request that is whole and right is answered half a bit after its last stop bit; meanwhile nothing is received. Any
    other has no effect, and the receiver waits until the line has been quiet for `QUIET_BITS` bits. One timer, one
    register for a word and one for the check serve both directions.

    - `bit_cycles`: Clocks of a bit, at least 8.
    """

    bus = "uart"

    def __init__(self, registers: RegisterMap, bit_cycles: int) -> None:
        self._bit_cycles = bit_cycles
        super().__init__(
            registers,
            wait=In(1),  # something else is sent, and uses the native port: answers must wait
            occupied=Out(1),  # an answer is sent or waits; nothing else must begin
        )

    def build(self, m: Module) -> None:
        at, frame = _Characters(self._bit_cycles), _Frame()
        m.submodules.sync_uart_rx = Synchronizer(self.uart_rx, at.line)
        self._time_characters(m, at)
        self._shift_bits(m, at, frame)
        self._count_words(m, at, frame)
        self._follow_frame(m, at, frame)
        self._answer(m, at, frame)
        self._reach_registers(m, at, frame)
        self._send(m, at, frame)

    def _time_characters(self, m: Module, at: _Characters) -> None:
        """Set the clocks in which a bit is sampled, or begins; a start bit begins to receive."""
        beat, place = at.beat, at.place
        m.d.comb += [
            beat.eq(at.timer == 0),
            at.busy.eq(at.receiving | at.sending),
            at.bit_there.eq(beat & at.busy & (place != 0) & (place != _STOP)),
            at.ended.eq(beat & at.busy & (place == _STOP)),
        ]
        m.d.sync += at.timer.eq(Mux(beat, self._bit_cycles - 1, at.timer - 1))
        with m.If(beat):
            m.d.sync += place.eq(Mux(at.sending & (place == _STOP), 0, next_number(place)))
        with m.If(~at.busy & ~at.due & ~at.line):
            m.d.sync += [at.receiving.eq(1), place.eq(0), at.timer.eq(self._bit_cycles // 2 - 1)]
        with m.If(at.ended | (beat & (place == 0) & at.line)):  # the latter is no start bit
            m.d.sync += at.receiving.eq(0)

    def _shift_bits(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Shift each bit into the check, and into or out of header and word."""
        place = at.place
        m.d.comb += [
            frame.out.eq(
                (frame.in_header & (frame.header[0] | (place == FROM_CORE + 1)))
                | (frame.in_address & frame.error & (place == 1))
                | (frame.in_data & frame.word[0])
                | (frame.in_check & frame.check[-1])
            ),
            frame.bit.eq(Mux(at.sending, frame.out, at.line)),
            frame.wrong.eq(frame.bit ^ frame.check[-1]),
            frame.more.eq(~frame.writing & frame.count.any()),
        ]
        strange = frame.in_header & ~at.sending & frame.bit & (place > TYPE_LOW + 1)
        with m.If(at.bit_there):
            m.d.sync += frame.check.eq((frame.check << 1) ^ (frame.wrong.replicate(CRC_WIDTH) & CRC_POLYNOMIAL))
            with m.If(frame.in_header):
                m.d.sync += frame.header.eq(Cat(frame.header[1:], frame.bit))
            with m.If(frame.in_data):
                m.d.sync += frame.word.eq(Cat(frame.word[1:], frame.bit))
            with m.If(strange | (frame.in_check & frame.wrong)):
                m.d.sync += frame.bad.eq(1)
        with m.If(at.beat & (place == 0) & frame.in_header):
            m.d.sync += frame.check.eq(CRC_START)

    def _count_words(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Let address and count go round while the first byte of a word is sent, counted on and down bit by bit."""
        address, count = frame.address, frame.count
        carry = Signal()
        borrow = Signal()
        counting = Signal()
        m.d.comb += counting.eq(at.sending & frame.in_data & (frame.number == 0))
        with m.If(at.bit_there & (frame.in_address | counting)):
            m.d.sync += [
                address.eq(Cat(address[1:], Mux(at.sending, address[0] ^ carry, at.line))),
                carry.eq(carry & address[0]),
            ]
        with m.If(at.bit_there & frame.in_data & (counting | ~at.sending)):
            m.d.sync += [
                count.eq(Cat(count[1:], Mux(at.sending, count[0] ^ borrow, at.line))),
                borrow.eq(borrow & ~count[0]),
            ]
        with m.If(at.ended):
            m.d.sync += [carry.eq(1), borrow.eq(1)]

    def _follow_frame(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Go from character to character, and from part to part."""
        part, number = frame.part, frame.number
        # An answer has its words before its status, a request its address before its data.
        in_answer = Mux(frame.in_check, _HEADER, Mux(frame.in_address, _CHECK, Mux(frame.more, _DATA, _ADDRESS)))
        of_count = frame.in_data & ~at.sending & ~frame.writing  # a request to read has one byte there
        with m.If(at.ended):
            m.d.sync += number.eq(next_number(number))
            with m.If(frame.in_header | frame.in_address | frame.word_ends | of_count | frame.done):
                m.d.sync += number.eq(0)
                m.d.sync += part.eq(Mux(at.sending, in_answer, next_number(part)))
            with m.If(~at.sending & ~at.line):
                m.d.sync += frame.bad.eq(1)
            with m.If(frame.done):
                m.d.sync += at.sending.eq(0)

    def _answer(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Begin an answer behind a right request, or later where it must wait; a quiet line begins anew."""
        asks = Signal()
        answered = frame.answered
        m.d.comb += [
            asks.eq(at.ended & frame.done & frame.right),
            answered.eq((asks | (at.beat & at.due)) & ~self.wait),
            self.occupied.eq(at.sending | at.due | answered),
        ]
        with m.If(at.beat):
            m.d.sync += at.due.eq((asks | at.due) & self.wait)
        with m.If(answered):
            m.d.sync += [at.sending.eq(1), frame.error.eq(0), at.place.eq(0)]
        with m.If(at.beat & ~at.busy & (at.place == QUIET_BITS - 1)):
            m.d.sync += [frame.part.eq(_HEADER), frame.number.eq(0), frame.bad.eq(0)]

    def _reach_registers(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Read and write by the native port."""
        native, address = self.native, frame.address
        words = len(native.address)
        m.d.comb += [
            frame.right.eq(~at.sending & ~frame.bad & at.line),
            # At the highest address there is no register.
            native.address.eq(address[:words] | address[words:].any().replicate(words)),
            native.read.eq(at.ended & at.sending & (frame.in_header | frame.word_ends) & frame.more),
            native.write.eq(frame.answered & frame.writing),
            native.write_data.eq(frame.word),
        ]
        m.d.sync += frame.asked.eq(native.read | native.write)
        with m.If(frame.asked):
            m.d.sync += [frame.word.eq(native.read_data), frame.error.eq(frame.error | native.error)]

    def _send(self, m: Module, at: _Characters, frame: _Frame) -> None:
        """Drive the output: a start bit, data, a stop bit, and high between."""
        level = Signal(init=1)
        m.d.comb += self.uart_tx.eq(level)
        with m.If(at.beat & at.sending):
            m.d.sync += level.eq((at.place == _STOP) | ((at.place != 0) & frame.out))
