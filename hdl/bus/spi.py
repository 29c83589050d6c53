"""SPI."""

from amaranth import Cat, Module, Mux, Signal

from tachometry.hdl.bus.bridge import Bridge, next_number
from tachometry.hdl.wires.synchronizer import Synchronizer
from tachometry.spec.registers.frames import SPI_ADDRESS_WIDTH
from tachometry.spec.registers.map import WORD


class SpiBridge(Bridge):
    """SPI in mode 0, most significant bit first, as `spec.registers.frames` describes it.

    The lines are sampled in the clock domain, so that sck may have at most an eighth of the clock's frequency, and must
    be low and high for at least 4 clocks. Then miso changes at the latest 3 clocks after sck fell, and a clock is left
    for pads and board. Chip select must fall at least 2 clocks before sck rises, rise at least 2 clocks after it fell,
    and be high for at least 4.

    Latency: a read is made in the second clock after the one in which the first bit of its status byte is sampled, a
    write in the third clock after the one in which its last bit is sampled.
    """

    bus = "spi"

    def elaborate(self, platform: object) -> Module:
        m = Module()
        native = self.native
        sck = Signal()
        mosi = Signal()
        cs_n = Signal()
        for pin, level in ((self.spi_sck, sck), (self.spi_mosi, mosi), (self.spi_cs_n, cs_n)):
            m.submodules[f"sync_{pin.name}"] = Synchronizer(pin, level)
        before = Signal()
        released = Signal()
        selected = Signal()
        rise = Signal()
        fall = Signal()
        # A frame that was under way at reset is left out.
        m.d.sync += [before.eq(sck), released.eq(released | cs_n)]
        m.d.comb += [
            selected.eq(released & ~cs_n),
            rise.eq(selected & sck & ~before),
            fall.eq(selected & ~sck & before),
        ]

        # The count of bits runs through a byte of status, from 0, and the four of a word, from 32 to 63.
        count = Signal(6)
        command = Signal(init=1)
        address = Signal(SPI_ADDRESS_WIDTH)
        writing = Signal()
        word = Signal(WORD)
        error = Signal()
        asked = Signal()
        whole = Signal()
        in_word = count[5]
        byte_begins, byte_ends = count[:3] == 0, count[:3].all()
        with m.If(rise):
            m.d.sync += [
                count.eq(next_number(count)),
                count[3].eq(count[3] ^ (in_word & byte_ends)),
                # From the command a write goes on with the word, and a read with status.
                in_word.eq(Mux(in_word, ~count[:5].all(), byte_ends & (address[-1] | ~command))),
                command.eq(command & ~byte_ends),
            ]
            with m.If(command):
                m.d.sync += Cat(address, writing).eq(Cat(mosi, address))
            with m.If(in_word):
                m.d.sync += word.eq(Cat(mosi, word))
        m.d.sync += whole.eq(rise & count.all())
        with m.If(whole):
            m.d.sync += address.eq(next_number(address))

        words = len(native.address)
        m.d.comb += [
            # At the highest address there is no register.
            native.address.eq(address[:words] | address[words:].any().replicate(words)),
            native.read.eq(rise & ~command & ~writing & ~in_word & byte_begins),
            native.write.eq(whole & writing),
            native.write_data.eq(word),
        ]
        m.d.sync += asked.eq(native.read | native.write)
        with m.If(asked):
            m.d.sync += [error.eq(native.error), word.eq(native.read_data)]

        status = byte_begins | (byte_ends & error)
        with m.If(fall):
            m.d.sync += self.spi_miso.eq(~command & Mux(in_word, word[-1] & ~writing, status))
        with m.If(~selected):
            m.d.sync += [count.eq(0), command.eq(1), self.spi_miso.eq(0)]
        return m
