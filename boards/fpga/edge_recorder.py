"""A board records edges of an encoder, and sends them to `tachometry calibrate --port`."""

from amaranth import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tachometry.boards.fpga.board import Board
from tachometry.hdl.wires.ports import Box
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.registers.edges import BAUD, EDGE, HEADER, LEVELS, MAGIC

_WORD = 8 * EDGE
_FIRST = HEADER.size // EDGE  # words of the header


def recorder_of(board: Board) -> "EdgeRecorder":
    """Return the recorder that a board has room for."""
    return EdgeRecorder(board.clock_hz, round(board.clock_hz / BAUD), board.edges)


class EdgeRecorder(Box):
    """Fills a memory with edges when a character comes over `uart_rx`, then sends it, and waits for the next one.

    An edge is a word with the levels of A, B and Z, and the clocks since the word before; where these are too many, a
    word repeats the levels. The first word has the levels at the beginning.

    - `clock_hz`, `bit_cycles`: The clock, and clocks of a bit of the UART.
    - `edges`: Words of the memory.
    """

    def __init__(self, clock_hz: int, bit_cycles: int, edges: int = 8192) -> None:
        self._header, self._bit_cycles, self._edges = HEADER.pack(MAGIC, clock_hz, edges), bit_cycles, edges
        super().__init__({**dict.fromkeys(("a", "b", "z", "uart_rx"), In(1)), "uart_tx": Out(1, init=1)})

    def build(self, m: Module) -> None:
        pins, levels, was = (Signal(LEVELS + 1, name=name) for name in ("pins", "levels", "was"))
        gap = Signal(_WORD - LEVELS)
        place = Signal(range(self._edges + _FIRST + 1))
        recording, sending, begins = (Signal(name=name) for name in ("recording", "sending", "begins"))
        m.submodules.memory = memory = Memory(shape=_WORD, depth=self._edges, init=[])
        write, read = memory.write_port(), memory.read_port()
        m.submodules.sync_pins = Synchronizer(pins, levels)
        m.d.comb += [
            pins.eq(Cat(self.a, self.b, self.z, ~self.uart_rx)),
            write.addr.eq(place),
            write.data.eq(Cat(levels[:LEVELS], gap)),
            write.en.eq(recording & (begins | gap.all() | (levels[:LEVELS] != was[:LEVELS]))),
            read.addr.eq(place - _FIRST),
        ]
        m.d.sync += [was.eq(levels), gap.eq(Mux(write.en, 1, gap + 1)), begins.eq(0)]
        with m.If(write.en):
            m.d.sync += place.eq(place + 1)
            with m.If(place == self._edges - 1):
                m.d.sync += [recording.eq(0), sending.eq(1), place.eq(0)]
        with m.If(~recording & ~sending & levels[-1]):
            m.d.sync += [recording.eq(1), begins.eq(1), gap.eq(0), place.eq(0)]
        with m.If(self._send(m, sending, Mux(place < _FIRST, self._of_header(place), read.data))):
            m.d.sync += place.eq(place + 1)
            with m.If(place == self._edges + _FIRST - 1):
                m.d.sync += sending.eq(0)

    def _of_header(self, place: Signal) -> Value:
        return Const(int.from_bytes(self._header, "little"), 8 * HEADER.size).word_select(place[:2], _WORD)

    def _send(self, m: Module, sending: Signal, word: Value) -> Signal:
        """Send a word byte by byte; return whether its last one begins."""
        timer = Signal(range(self._bit_cycles))
        line = Signal(10, init=-1)
        left = Signal(range(len(line) + 1))  # bits
        byte = Signal(range(EDGE))
        begins = Signal()
        m.d.comb += [self.uart_tx.eq(line[0]), begins.eq(sending & (left == 0))]
        m.d.sync += timer.eq(Mux(begins | (timer == 0), self._bit_cycles - 1, timer - 1))
        with m.If(begins):
            m.d.sync += [line.eq(Cat(0, word.word_select(byte, 8), 1)), left.eq(len(line))]
            m.d.sync += byte.eq(Mux(byte == EDGE - 1, 0, byte + 1))
        with m.Elif((timer == 0) & (left != 0)):
            m.d.sync += [line.eq(Cat(line[1:], 1)), left.eq(left - 1)]
        last = Signal()
        m.d.comb += last.eq(begins & (byte == EDGE - 1))
        return last
