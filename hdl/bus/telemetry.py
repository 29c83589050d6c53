"""A sender makes frames of telemetry on a UART."""

from amaranth import Cat, Const, Module, Mux, Signal
from amaranth.lib.wiring import In, Out

from tachometry.hdl.bus.native import native_port
from tachometry.hdl.wires.ports import Box
from tachometry.spec.language.field import WORD
from tachometry.spec.registers.frames import CRC_POLYNOMIAL, CRC_START, CRC_WIDTH, FROM_CORE, SEQUENCES, TYPE_LOW, Type
from tachometry.spec.registers.map import RegisterMap

_STOP = 9  # place of the stop bit; that of the start bit is 0
_WORD_BYTES = WORD // 8


class _Bytes:
    """Holds the signals of the byte and of the part of a frame that is sent."""

    def __init__(self, n_words: int, bit_cycles: int) -> None:
        self.begins = Signal()
        self.shown = Signal(range(SEQUENCES))  # the sequence number of the frame
        self.timer = Signal(range(bit_cycles))  # clocks until the next beat
        self.place = Signal(range(_STOP + 1))  # the bit within the byte
        self.beat = Signal()  # a bit begins
        self.ended = Signal()  # the stop bit does
        # The parts: header, words, status, check.
        self.in_header, self.in_words, self.in_status, self.in_check = (Signal(name=f"in_{part}") for part in "hwsc")
        self.left = Signal(range(n_words + 1))  # words that are not sent
        self.byte = Signal(range(_WORD_BYTES))
        self.word = Signal(WORD)
        self.check = Signal(CRC_WIDTH)
        self.word_ends = self.in_words & (self.byte == _WORD_BYTES - 1)


class TelemetrySender(Box):
    """Sends all captured registers in a frame, as `spec.registers.frames` describes it.

    The registers are captured in the clock in which the frame begins.
    """

    def __init__(self, registers: RegisterMap, bit_cycles: int) -> None:
        captured = [number for number, register in enumerate(registers) if register.captured]
        self._first, self._words = captured[0], len(captured)
        self._bit_cycles = bit_cycles
        super().__init__(
            native=Out(native_port(registers.address_width - 2)),
            send=In(1),  # a frame is wanted; it is left out if the one before has not begun
            wait=In(1),  # none may begin
            busy=Out(1),  # one is under way
            line=Out(1, init=1),  # high when idle
        )

    def build(self, m: Module) -> None:
        at = _Bytes(self._words, self._bit_cycles)
        sequence = self._begin(m, at)
        self._time_bits(m, at)
        self._send_bits(m, at)
        self._follow_frame(m, at)
        with m.If(at.begins):
            m.d.sync += [self.busy.eq(1), at.in_header.eq(1), at.left.eq(self._words), at.check.eq(CRC_START)]
            m.d.sync += [at.place.eq(0), at.shown.eq(sequence)]
        self._read_words(m, at)

    def _begin(self, m: Module, at: _Bytes) -> Signal:
        """Begin a frame that is wanted when none is under way; return the number of the one that is wanted."""
        wanted = Signal()
        sequence = Signal(range(SEQUENCES))
        m.d.comb += at.begins.eq(wanted & ~self.busy & ~self.wait)
        m.d.sync += wanted.eq(self.send | (wanted & ~at.begins))
        with m.If(self.send):
            m.d.sync += sequence.eq(sequence + 1)
        return sequence

    def _time_bits(self, m: Module, at: _Bytes) -> None:
        """Set the clocks in which a bit begins, and a byte ends."""
        m.d.comb += [at.beat.eq(self.busy & (at.timer == 0)), at.ended.eq(at.beat & (at.place == _STOP))]
        m.d.sync += at.timer.eq(Mux(at.begins | (at.timer == 0), self._bit_cycles - 1, at.timer - 1))
        with m.If(at.beat):
            m.d.sync += at.place.eq(Mux(at.ended, 0, at.place + 1))

    def _send_bits(self, m: Module, at: _Bytes) -> None:
        """Send the bits of a byte, and let the check follow them."""
        place, check = at.place, at.check
        header = Cat(at.shown, Const(1 << FROM_CORE - TYPE_LOW | Type.TELEMETRY, 8 - TYPE_LOW))
        out = Signal()
        m.d.comb += out.eq(
            (at.in_header & header.bit_select((place - 1)[:3], 1))
            | (at.in_words & at.word[0])
            | (at.in_check & check[-1])
        )
        with m.If(at.beat & (place != 0) & ~at.ended):
            m.d.sync += check.eq((check << 1) ^ ((out ^ check[-1]).replicate(CRC_WIDTH) & CRC_POLYNOMIAL))
            with m.If(at.in_words):
                m.d.sync += at.word.eq(at.word >> 1)
        with m.If(at.beat):
            m.d.sync += self.line.eq(at.ended | ((place != 0) & out))

    def _follow_frame(self, m: Module, at: _Bytes) -> None:
        """Go from byte to byte, and from part to part."""
        with m.If(at.ended):
            m.d.sync += at.byte.eq(at.byte + (at.in_words | at.in_check))
            with m.If(at.in_header):
                m.d.sync += [at.in_header.eq(0), at.in_words.eq(1), at.byte.eq(0)]
            with m.If(at.word_ends):
                m.d.sync += at.left.eq(at.left - 1)
                with m.If(at.left == 1):
                    m.d.sync += [at.in_words.eq(0), at.in_status.eq(1)]
            with m.If(at.in_status):
                m.d.sync += [at.in_status.eq(0), at.in_check.eq(1), at.byte.eq(0)]
            with m.If(at.in_check & at.byte[0]):
                m.d.sync += [at.in_check.eq(0), self.busy.eq(0)]

    def _read_words(self, m: Module, at: _Bytes) -> None:
        """Read the next word by the native port; reading the first one captures."""
        native = self.native
        address = Signal(native.address.shape())
        asked = Signal()
        m.d.comb += [
            native.read.eq(at.begins | (at.ended & at.word_ends & (at.left != 1))),
            native.address.eq(Mux(at.begins, self._first, address)),
        ]
        m.d.sync += asked.eq(native.read)
        with m.If(native.read):
            m.d.sync += address.eq(native.address + 1)
        with m.If(asked):
            m.d.sync += at.word.eq(native.read_data)
