"""UART."""

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.bridge import Bridge, next_number
from tachometry.hdl.wires.synchronizer import Synchronizer
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
from tachometry.spec.registers.map import WORD, RegisterMap

_STOP = 9  # place of the stop bit; that of the start bit is 0
# Parts of a frame. In place of the address an answer has its status.
_HEADER, _ADDRESS, _DATA, _CHECK = range(4)


class UartBridge(Bridge):
    """UART, 8 bits without parity, with the frames that `spec.registers.frames` describes.

    A request that is whole and right is answered half a bit after its last stop bit; meanwhile nothing is received. Any
    other has no effect, and the receiver waits until the line has been quiet for `QUIET_BITS` bits. One timer, one
    register for a word and one for the check serve both directions.

    Parameters
    ----------
    registers : RegisterMap
    bit_cycles : int
        Clocks of a bit, at least 8.

    Members
    -------
    Those of a `Bridge`, and

    wait : In(1)
        Answers must wait: something else is sent, and uses the native port. 0 unless it is connected.
    occupied : Out(1)
        An answer is sent or waits; nothing else must begin.
    """

    bus = "uart"

    def __init__(self, registers: RegisterMap, bit_cycles: int) -> None:
        self._bit_cycles = bit_cycles
        super().__init__(registers, wait=In(1), occupied=Out(1))

    def elaborate(self, platform: object) -> Module:
        m = Module()
        native, cycles = self.native, self._bit_cycles
        line = Signal()
        m.submodules.sync_uart_rx = Synchronizer(self.uart_rx, line)

        # Characters: where a bit is to be sampled, or to begin.
        timer = Signal(range(cycles))
        place = Signal(range(QUIET_BITS))
        beat = Signal()
        receiving = Signal()
        sending = Signal()
        busy = Signal()
        bit_there = Signal()
        ended = Signal()
        m.d.comb += [
            beat.eq(timer == 0),
            busy.eq(receiving | sending),
            bit_there.eq(beat & busy & (place != 0) & (place != _STOP)),
            ended.eq(beat & busy & (place == _STOP)),
        ]
        m.d.sync += timer.eq(Mux(beat, cycles - 1, timer - 1))
        with m.If(beat):
            m.d.sync += place.eq(Mux(sending & (place == _STOP), 0, next_number(place)))
        due = Signal()  # an answer waits
        with m.If(~busy & ~due & ~line):
            m.d.sync += [receiving.eq(1), place.eq(0), timer.eq(cycles // 2 - 1)]
        with m.If(ended | (beat & (place == 0) & line)):  # the latter is no start bit
            m.d.sync += receiving.eq(0)

        # Frames.
        part = Signal(2)
        number = Signal(2)
        header = Signal(8)
        address = Signal(UART_ADDRESS_WIDTH)
        count = Signal(COUNT_WIDTH)
        word = Signal(WORD)
        check = Signal(CRC_WIDTH)
        bad = Signal()
        error = Signal()
        asked = Signal()
        more = Signal()
        right = Signal()
        out = Signal()
        bit = Signal()
        wrong = Signal()
        in_header, in_address, in_data, in_check = ((part == one) for one in range(4))
        writing = header[TYPE_LOW]
        m.d.comb += [
            out.eq(
                (in_header & (header[0] | (place == FROM_CORE + 1)))
                | (in_address & error & (place == 1))
                | (in_data & word[0])
                | (in_check & check[-1])
            ),
            bit.eq(Mux(sending, out, line)),
            wrong.eq(bit ^ check[-1]),
            more.eq(~writing & count.any()),
        ]
        with m.If(bit_there):
            m.d.sync += check.eq((check << 1) ^ (wrong.replicate(CRC_WIDTH) & CRC_POLYNOMIAL))
            with m.If(in_header):
                m.d.sync += header.eq(Cat(header[1:], bit))
            with m.If(in_data):
                m.d.sync += word.eq(Cat(word[1:], bit))
            with m.If((in_header & ~sending & bit & (place > TYPE_LOW + 1)) | (in_check & wrong)):
                m.d.sync += bad.eq(1)
        with m.If(beat & (place == 0) & in_header):
            m.d.sync += check.eq(CRC_START)

        # While the first byte of a word is sent, address and count go round, and are counted on and down bit by bit.
        carry = Signal()
        borrow = Signal()
        counting = Signal()
        m.d.comb += counting.eq(sending & in_data & (number == 0))
        with m.If(bit_there & (in_address | counting)):
            m.d.sync += [
                address.eq(Cat(address[1:], Mux(sending, address[0] ^ carry, line))),
                carry.eq(carry & address[0]),
            ]
        with m.If(bit_there & in_data & (counting | ~sending)):
            m.d.sync += [count.eq(Cat(count[1:], Mux(sending, count[0] ^ borrow, line))), borrow.eq(borrow & ~count[0])]
        with m.If(ended):
            m.d.sync += [carry.eq(1), borrow.eq(1)]

        word_ends = in_data & (number == 3)
        done = in_check & number[0]
        with m.If(ended):
            m.d.sync += number.eq(next_number(number))
            with m.If(in_header | in_address | word_ends | (in_data & ~sending & ~writing) | done):
                m.d.sync += number.eq(0)
                # An answer has its words before its status, a request its address before its data.
                m.d.sync += part.eq(
                    Mux(
                        sending,
                        Mux(in_check, _HEADER, Mux(in_address, _CHECK, Mux(more, _DATA, _ADDRESS))),
                        next_number(part),
                    )
                )
            with m.If(~sending & ~line):
                m.d.sync += bad.eq(1)
            with m.If(done):
                m.d.sync += sending.eq(0)
        asks = Signal()
        answered = Signal()
        m.d.comb += [
            asks.eq(ended & done & right),
            answered.eq((asks | (beat & due)) & ~self.wait),
            self.occupied.eq(sending | due | answered),
        ]
        with m.If(beat):
            m.d.sync += due.eq((asks | due) & self.wait)
        with m.If(answered):
            m.d.sync += [sending.eq(1), error.eq(0), place.eq(0)]
        with m.If(beat & ~busy & (place == QUIET_BITS - 1)):
            m.d.sync += [part.eq(_HEADER), number.eq(0), bad.eq(0)]

        words = len(native.address)
        m.d.comb += [
            right.eq(~sending & ~bad & line),
            # At the highest address there is no register.
            native.address.eq(address[:words] | address[words:].any().replicate(words)),
            native.read.eq(ended & sending & (in_header | word_ends) & more),
            native.write.eq(answered & writing),
            native.write_data.eq(word),
        ]
        m.d.sync += asked.eq(native.read | native.write)
        with m.If(asked):
            m.d.sync += [word.eq(native.read_data), error.eq(error | native.error)]

        level = Signal(init=1)
        m.d.comb += self.uart_tx.eq(level)
        with m.If(beat & sending):
            m.d.sync += level.eq((place == _STOP) | ((place != 0) & out))
        return m
