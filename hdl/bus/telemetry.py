"""Frames of telemetry on a UART."""

from amaranth import Cat, Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.native import native_port
from tachometry.spec.registers.frames import (
    CRC_POLYNOMIAL,
    CRC_START,
    CRC_WIDTH,
    FROM_CORE,
    SEQUENCES,
    TYPE_LOW,
    Type,
)
from tachometry.spec.registers.map import WORD, RegisterMap

_STOP = 9  # place of the stop bit; that of the start bit is 0
_WORD_BYTES = WORD // 8


class TelemetrySender(wiring.Component):
    """Sends all captured registers in a frame, as `spec.registers.frames` describes it.

    The registers are captured in the clock in which the frame begins.

    Parameters
    ----------
    registers : RegisterMap
    bit_cycles : int
        Clocks of a bit.

    Members
    -------
    native : Out(native_port)
    send : In(1)
        A frame is wanted. It is left out if the one before has not begun.
    wait : In(1)
        None may begin.
    busy : Out(1)
        One is under way.
    line : Out(1)
        High when idle.
    """

    def __init__(self, registers: RegisterMap, bit_cycles: int) -> None:
        captured = [number for number, register in enumerate(registers) if register.captured]
        self._first, self._words = captured[0], len(captured)
        self._bit_cycles = bit_cycles
        super().__init__(
            {
                "native": Out(native_port(registers.address_width - 2)),
                "send": In(1),
                "wait": In(1),
                "busy": Out(1),
                "line": Out(1, init=1),
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        native = self.native
        wanted = Signal()
        begins = Signal()
        sequence = Signal(range(SEQUENCES))  # of the frame that is wanted
        shown = Signal.like(sequence)
        m.d.comb += begins.eq(wanted & ~self.busy & ~self.wait)
        m.d.sync += wanted.eq(self.send | (wanted & ~begins))
        with m.If(self.send):
            m.d.sync += sequence.eq(sequence + 1)

        timer = Signal(range(self._bit_cycles))
        place = Signal(range(_STOP + 1))
        beat = Signal()
        ended = Signal()  # a byte
        m.d.comb += [beat.eq(self.busy & (timer == 0)), ended.eq(beat & (place == _STOP))]
        m.d.sync += timer.eq(Mux(begins | (timer == 0), self._bit_cycles - 1, timer - 1))
        with m.If(beat):
            m.d.sync += place.eq(Mux(ended, 0, place + 1))

        # The bytes: header, words, status, check. Of the words, `left` are not sent.
        in_header, in_words, in_status, in_check = (Signal(name=f"in_{part}") for part in ("h", "w", "s", "c"))
        left = Signal(range(self._words + 1))
        byte = Signal(range(_WORD_BYTES))
        word = Signal(WORD)
        check = Signal(CRC_WIDTH)
        header = Cat(shown, Const(1 << FROM_CORE - TYPE_LOW | Type.TELEMETRY, 8 - TYPE_LOW))
        out = Signal()
        m.d.comb += out.eq(
            (in_header & header.bit_select((place - 1)[:3], 1)) | (in_words & word[0]) | (in_check & check[-1])
        )
        with m.If(beat & (place != 0) & ~ended):
            m.d.sync += check.eq((check << 1) ^ ((out ^ check[-1]).replicate(CRC_WIDTH) & CRC_POLYNOMIAL))
            with m.If(in_words):
                m.d.sync += word.eq(word >> 1)
        with m.If(beat):
            m.d.sync += self.line.eq(ended | ((place != 0) & out))

        word_ends = in_words & (byte == _WORD_BYTES - 1)
        with m.If(ended):
            m.d.sync += byte.eq(byte + (in_words | in_check))
            with m.If(in_header):
                m.d.sync += [in_header.eq(0), in_words.eq(1), byte.eq(0)]
            with m.If(word_ends):
                m.d.sync += left.eq(left - 1)
                with m.If(left == 1):
                    m.d.sync += [in_words.eq(0), in_status.eq(1)]
            with m.If(in_status):
                m.d.sync += [in_status.eq(0), in_check.eq(1), byte.eq(0)]
            with m.If(in_check & byte[0]):
                m.d.sync += [in_check.eq(0), self.busy.eq(0)]
        with m.If(begins):
            m.d.sync += [self.busy.eq(1), in_header.eq(1), left.eq(self._words), check.eq(CRC_START), place.eq(0)]
            m.d.sync += shown.eq(sequence)

        # Reading the first word captures.
        address = Signal(native.address.shape())
        asked = Signal()
        m.d.comb += [
            native.read.eq(begins | (ended & word_ends & (left != 1))),
            native.address.eq(Mux(begins, self._first, address)),
        ]
        m.d.sync += asked.eq(native.read)
        with m.If(native.read):
            m.d.sync += address.eq(native.address + 1)
        with m.If(asked):
            m.d.sync += word.eq(native.read_data)
        return m
