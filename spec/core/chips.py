"""Reads of an absolute encoder with SPI: its chips, their words, and times in clocks of the core."""

from dataclasses import dataclass, replace
from typing import ClassVar

from tachometry.spec.core.reads import ERROR_BIT, NO_ANSWER, SYNCHRONISER, WRONG_CHECK, Reads
from tachometry.spec.language.port import Port, pin

WORD_BITS, POSITION_BITS = 16, 14  # bits of a frame, and of the position at its end


@dataclass(frozen=True)
class Chip:
    """Facts of a chip, from its data sheet."""

    bits: tuple[int, ...]  # that a position can have, the usual number first
    usual_hz: int
    fastest_hz: int
    setup: int  # ns from chip select to the first bit, between bytes, and from the last bit on
    rest: int  # ns between two chip selects
    falling: bool  # SPI mode 1: a bit begins with a rise of the clock; else mode 0: with a fall
    bytewise: bool  # it waits between two bytes
    late: bool  # its answer is to the frame before, and the position is that of its end
    command: int
    clear: int = 0  # the command after an error bit, which clears it: the answer to it is no position


CHIPS = {
    "as5047p": Chip((14,), 5_000_000, 10_000_000, 350, 350, True, False, True, 0xFFFF, 0x4001),
    "amt22": Chip((14, 12), 1_000_000, 2_000_000, 3_000, 40_000, False, True, False, 0),
}


@dataclass(frozen=True)
class SpiReads(Reads):
    """The reads of a chip: a frame is a word, the highest bit first. Its clock is low between frames."""

    chip: str = ""
    tick: int = 0  # clocks of a nominal tick, and of the longest one
    longest_tick: int = 0

    ports: ClassVar = (
        pin("spi_miso", "Data of the encoder, asynchronous."),
        Port("spi_sck", "output", help="Clock of the encoder; it is low between reads."),
        Port("spi_cs_n", "output", help="Chip select of the encoder; it is low during a read."),
        Port("spi_mosi", "output", help="Command to the encoder, the highest bit first."),
    )

    def within(self, tick: int, longest_tick: int) -> "SpiReads":
        return replace(self, tick=tick, longest_tick=longest_tick)

    @property
    def facts(self) -> Chip:
        """Facts of the chip."""
        return CHIPS[self.chip]

    @property
    def late(self) -> bool:
        return self.facts.late

    @property
    def reasons(self) -> tuple[int, ...]:
        return NO_ANSWER, WRONG_CHECK, *(ERROR_BIT,) * self.late

    @property
    def half(self) -> int:
        # Each bit is read before the half of its period ends in which it is stable.
        return max(super().half, self.delay + SYNCHRONISER + 1)

    @property
    def setup(self) -> int:
        """Clocks from chip select to the first bit, between bytes, and from the last bit on."""
        return max(self._clocks_of_ns(self.facts.setup), self.half)

    @property
    def changes(self) -> tuple[int, ...]:
        """Clocks from the strobe that begins a read to the edges at which the encoder sends its bits."""
        first = 1 + self.setup - self.half * (not self.facts.falling)
        gap = self.setup * self.facts.bytewise
        return tuple(first + 2 * self.half * bit + gap * (bit >= WORD_BITS // 2) for bit in range(WORD_BITS))

    @property
    def taken(self) -> int:
        return self.longest - self.tick if self.late else 1

    @property
    def oldest(self) -> int:
        return self.tick if self.late else self.longest - 1

    @property
    def age_width(self) -> int:
        # A late answer is older than two ticks if its command is, or if there was none.
        return (2 * self.longest_tick).bit_length() if self.late else super().age_width

    @property
    def age_spread(self) -> int:
        return 2 * self.longest_tick if self.late and self.longest_tick > self.tick else 0

    @property
    def longest(self) -> int:
        return 1 + self.setup * (2 + self.facts.bytewise) + 2 * self.half * WORD_BITS

    @property
    def rest(self) -> int:
        return self._clocks_of_ns(self.facts.rest) + 2
