"""A bridge answers SPI from the bank of registers."""

from amaranth import Cat, Module, Mux, Signal

from tachometry.hdl.bus.bridge import Bridge, next_number
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.language.field import WORD
from tachometry.spec.registers.frames import SPI_ADDRESS_WIDTH


class _Lines:
    """Holds the levels of the lines, synchronised, and their edges within a frame."""

    def __init__(self) -> None:
        self.sck = Signal()
        self.mosi = Signal()
        self.cs_n = Signal()
        self.selected = Signal()
        self.rise = Signal()
        self.fall = Signal()


class _Frame:
    """Holds the signals of a frame: a command, and then status and words."""

    def __init__(self) -> None:
        # It runs through a byte of status, from 0, and the four of a word, from 32 to 63.
        self.count = Signal(6)
        self.command = Signal(init=1)  # the first byte comes
        self.address = Signal(SPI_ADDRESS_WIDTH)
        self.writing = Signal()
        self.word = Signal(WORD)
        self.error = Signal()
        self.asked = Signal()  # the native port answers in this clock
        self.whole = Signal()  # a word has been sent or received
        self.in_word = self.count[5]
        self.byte_begins, self.byte_ends = self.count[:3] == 0, self.count[:3].all()


class SpiBridge(Bridge):
    """Answers SPI in mode 0, most significant bit first, as `spec.registers.frames` describes it.

    The lines are sampled in the clock domain, so that sck may have at most an eighth of the clock's frequency, and must
    be low and high for at least 4 clocks. Then miso changes at the latest 3 clocks after sck fell, and a clock is left
    for pads and board. Chip select must fall at least 2 clocks before sck rises, rise at least 2 clocks after it fell,
    and be high for at least 4.

    Latency: a read is made in the second clock after the one in which the first bit of its status byte is sampled, a
    write in the third clock after the one in which its last bit is sampled.
    """

    bus = "spi"

    def build(self, m: Module) -> None:
        lines, frame = _Lines(), _Frame()
        self._watch(m, lines)
        self._shift(m, lines, frame)
        self._reach_registers(m, lines, frame)
        self._send(m, lines, frame)

    def _watch(self, m: Module, lines: _Lines) -> None:
        """Find the edges of the clock; a frame that was under way at reset is left out."""
        for pin, level in ((self.spi_sck, lines.sck), (self.spi_mosi, lines.mosi), (self.spi_cs_n, lines.cs_n)):
            m.submodules[f"sync_{pin.name}"] = Synchronizer(pin, level)
        before = Signal()
        released = Signal()
        m.d.sync += [before.eq(lines.sck), released.eq(released | lines.cs_n)]
        m.d.comb += [
            lines.selected.eq(released & ~lines.cs_n),
            lines.rise.eq(lines.selected & lines.sck & ~before),
            lines.fall.eq(lines.selected & ~lines.sck & before),
        ]

    def _shift(self, m: Module, lines: _Lines, frame: _Frame) -> None:
        """Count the bits, and shift them into command and word."""
        count, in_word, command, address = frame.count, frame.in_word, frame.command, frame.address
        with m.If(lines.rise):
            m.d.sync += [
                count.eq(next_number(count)),
                count[3].eq(count[3] ^ (in_word & frame.byte_ends)),
                # From the command a write goes on with the word, and a read with status.
                in_word.eq(Mux(in_word, ~count[:5].all(), frame.byte_ends & (address[-1] | ~command))),
                command.eq(command & ~frame.byte_ends),
            ]
            with m.If(command):
                m.d.sync += Cat(address, frame.writing).eq(Cat(lines.mosi, address))
            with m.If(in_word):
                m.d.sync += frame.word.eq(Cat(lines.mosi, frame.word))
        m.d.sync += frame.whole.eq(lines.rise & count.all())
        with m.If(frame.whole):
            m.d.sync += address.eq(next_number(address))

    def _reach_registers(self, m: Module, lines: _Lines, frame: _Frame) -> None:
        """Read and write by the native port."""
        native, address = self.native, frame.address
        words = len(native.address)
        m.d.comb += [
            # At the highest address there is no register.
            native.address.eq(address[:words] | address[words:].any().replicate(words)),
            native.read.eq(lines.rise & ~frame.command & ~frame.writing & ~frame.in_word & frame.byte_begins),
            native.write.eq(frame.whole & frame.writing),
            native.write_data.eq(frame.word),
        ]
        m.d.sync += frame.asked.eq(native.read | native.write)
        with m.If(frame.asked):
            m.d.sync += [frame.error.eq(native.error), frame.word.eq(native.read_data)]

    def _send(self, m: Module, lines: _Lines, frame: _Frame) -> None:
        """Drive the output at each fall: status, or the word that is read."""
        status = frame.byte_begins | (frame.byte_ends & frame.error)
        with m.If(lines.fall):
            m.d.sync += self.spi_miso.eq(~frame.command & Mux(frame.in_word, frame.word[-1] & ~frame.writing, status))
        with m.If(~lines.selected):
            m.d.sync += [frame.count.eq(0), frame.command.eq(1), self.spi_miso.eq(0)]
