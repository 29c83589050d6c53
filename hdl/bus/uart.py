"""UART."""

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib import wiring

from tachometry.hdl.bus.bridge import bridge_members
from tachometry.hdl.front_end.synchronizer import Synchronizer
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


class UartBridge(wiring.Component):
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
    The ports of the bus, and

    native : Out(native_port)
    """

    def __init__(self, registers: RegisterMap, bit_cycles: int) -> None:
        self._bit_cycles = bit_cycles
        super().__init__(bridge_members("uart", registers))

    def elaborate(self, platform: object) -> Module:
        m = Module()
        native, cycles = self.native, self._bit_cycles
        line = Signal()
        m.submodules.sync_uart_rx = Synchronizer(self.uart_rx, line)

        # Characters: where a bit is to be sampled, or to begin.
        timer, place, beat = Signal(range(cycles)), Signal(range(QUIET_BITS)), Signal()
        receiving, sending, busy = Signal(), Signal(), Signal()
        bit_there, ended = Signal(), Signal()
        m.d.comb += [
            beat.eq(timer == 0),
            busy.eq(receiving | sending),
            bit_there.eq(beat & busy & (place != 0) & (place != _STOP)),
            ended.eq(beat & busy & (place == _STOP)),
        ]
        m.d.sync += timer.eq(Mux(beat, cycles - 1, timer - 1))
        with m.If(beat):
            m.d.sync += place.eq(Mux(sending & (place == _STOP), 0, place + 1))
        with m.If(~busy & ~line):
            m.d.sync += [receiving.eq(1), place.eq(0), timer.eq(cycles // 2 - 1)]
        with m.If(ended | (beat & (place == 0) & line)):  # the latter is no start bit
            m.d.sync += receiving.eq(0)

        # Frames.
        part, number = Signal(2), Signal(2)
        header, address = Signal(8), Signal(UART_ADDRESS_WIDTH)
        count, word, check = Signal(COUNT_WIDTH), Signal(WORD), Signal(CRC_WIDTH)
        bad, error, asked, more = Signal(), Signal(), Signal(), Signal()
        out, bit, wrong = Signal(), Signal(), Signal()
        writing = header[TYPE_LOW]
        m.d.comb += [
            bit.eq(Mux(sending, out, line)),
            wrong.eq(bit ^ check[-1]),
            more.eq(~writing & count.any()),
        ]
        with m.Switch(part):
            with m.Case(_HEADER):
                m.d.comb += out.eq(header[0] | (place == FROM_CORE + 1))
            with m.Case(_ADDRESS):
                m.d.comb += out.eq(error & (place == 1))
            with m.Case(_DATA):
                m.d.comb += out.eq(word[0])
            with m.Case(_CHECK):
                m.d.comb += out.eq(check[-1])
        with m.If(bit_there):
            m.d.sync += check.eq((check << 1) ^ (wrong.replicate(CRC_WIDTH) & CRC_POLYNOMIAL))
            with m.Switch(part):
                with m.Case(_HEADER):
                    m.d.sync += header.eq(Cat(header[1:], bit))
                    with m.If(~sending & bit & (place > TYPE_LOW + 1)):
                        m.d.sync += bad.eq(1)
                with m.Case(_ADDRESS):
                    m.d.sync += address.eq(Cat(address[1:], bit))
                with m.Case(_DATA):
                    m.d.sync += word.eq(Cat(word[1:], bit))
                    with m.If(~sending):
                        m.d.sync += count.eq(Cat(count[1:], bit))
                with m.Case(_CHECK), m.If(wrong):
                    m.d.sync += bad.eq(1)
        with m.If(beat & (place == 0) & (part == _HEADER)):
            m.d.sync += check.eq(CRC_START)

        with m.If(ended):
            m.d.sync += number.eq(0)
            with m.If(~sending & ~line):
                m.d.sync += bad.eq(1)
            with m.Switch(part):
                with m.Case(_HEADER):
                    m.d.sync += part.eq(Mux(sending & more, _DATA, _ADDRESS))
                with m.Case(_ADDRESS):
                    m.d.sync += part.eq(Mux(sending, _CHECK, _DATA))
                with m.Case(_DATA):
                    with m.If((number == 3) | (~sending & ~writing)):
                        m.d.sync += part.eq(Mux(~sending, _CHECK, Mux(more, _DATA, _ADDRESS)))
                    with m.Else():
                        m.d.sync += number.eq(number + 1)
                with m.Case(_CHECK):
                    with m.If(number[0]):
                        m.d.sync += part.eq(_HEADER)
                        with m.If(sending):
                            m.d.sync += [sending.eq(0), error.eq(0)]
                        with m.Elif(~bad & line):
                            m.d.sync += [sending.eq(1), place.eq(0)]
                            m.d.comb += native.write.eq(writing)
                    with m.Else():
                        m.d.sync += number.eq(1)
        with m.If(beat & ~busy & (place == QUIET_BITS - 1)):
            m.d.sync += [part.eq(_HEADER), number.eq(0), bad.eq(0)]

        words = len(native.address)
        next_word = (part == _HEADER) | ((part == _DATA) & (number == 3))
        m.d.comb += [
            # At the highest address there is no register.
            native.address.eq(address[:words] | address[words:].any().replicate(words)),
            native.read.eq(ended & sending & next_word & more),
            native.write_data.eq(word),
        ]
        m.d.sync += asked.eq(native.read | native.write)
        with m.If(native.read):
            m.d.sync += [address.eq(address + 1), count.eq(count - 1)]
        with m.If(asked):
            m.d.sync += [word.eq(native.read_data), error.eq(error | native.error)]

        level = Signal(init=1)
        m.d.comb += self.uart_tx.eq(level)
        with m.If(beat & sending):
            m.d.sync += level.eq((place == _STOP) | ((place != 0) & out))
        return m
