"""Reads of an absolute encoder by SSI or BiSS-C: frames, checks, and times in clocks of the core."""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from math import ceil
from operator import xor
from typing import ClassVar

from tachometry.spec.language.port import Port, pin

# Why a read yields no position.
NO_ANSWER, WRONG_CHECK, ERROR_BIT = 1, 2, 3
WARNING, JUMP = 4, 5  # what else can be wrong with one
READ_FAULT_BITS = 3
SYNCHRONISER = 2  # clocks from a pin to its level in the core
BISS_CRC = 0b1000011  # x^6 + x + 1


def remainders(polynomial: int, count: int) -> list[int]:
    """Return x^(w + i) modulo a polynomial of degree w for i from 0 on: the CRC of a message of bit i alone."""
    found, state = [], 1 << polynomial.bit_length() - 1
    for _ in range(count):
        state ^= polynomial if state >> polynomial.bit_length() - 1 else 0
        found.append(state)
        state <<= 1
    return found


@dataclass(frozen=True)
class Reads:
    """The reads of one encoder: a read begins with a strobe, and ends with another one, at most `longest` later."""

    width: int  # bits of a position
    clock_hz: int
    encoder_hz: int  # clock of the encoder's lines
    delay: int = 0  # of SSI: clocks from a rise of the encoder's clock until the answer to it is at the pin
    biss: bool = False
    gray: bool = False
    repeat: bool = False  # of SSI: read twice, and compare
    crc: int = 0  # of BiSS-C: the polynomial with its highest term; 0: the frame has none
    start_wait: int = 0  # of BiSS-C: clocks from the first rise until the start bit, at most

    # The first is the input.
    ports: ClassVar[tuple[Port, ...]] = (
        pin("encoder_data", "Data of the encoder, asynchronous; it is high between reads."),
        Port("encoder_clock", "output", help="Clock of the encoder; it is high between reads."),
    )

    def within(self, tick: int, longest_tick: int) -> "Reads":
        """Return the same for ticks of so many clocks, with as long a wait for the start bit as they leave time for."""
        left = tick - self.least_tick
        least = 4 * self.half + self.delay
        return replace(self, start_wait=max(min(self._clocks_of_ns(40_000), left), least)) if self.biss else self

    def _clocks_of_ns(self, nanoseconds: int) -> int:
        return ceil(Fraction(nanoseconds * self.clock_hz, 10**9))

    @property
    def line(self) -> str:
        """Name of the input."""
        return self.ports[0].name

    @property
    def reasons(self) -> tuple[int, ...]:
        """All that can be wrong with an answer."""
        if self.biss:
            return NO_ANSWER, WRONG_CHECK, ERROR_BIT, WARNING
        return (NO_ANSWER, *(WRONG_CHECK,) * self.repeat)

    @property
    def half(self) -> int:
        """Clocks of half a period of the encoder's clock, at least two."""
        return max(ceil(Fraction(self.clock_hz, 2 * self.encoder_hz)), 2)

    @property
    def late(self) -> bool:
        """Whether an answer is that to the frame before, at whose end the encoder took its position."""
        return False

    @property
    def is_exact(self) -> bool:
        """Whether bits are read near enough to their middle."""
        return True

    @property
    def crc_width(self) -> int:
        """Bits of the CRC."""
        return max(self.crc.bit_length() - 1, 0)

    @property
    def residue(self) -> int:
        """State of the CRC register after a right frame, whose CRC is sent inverted."""
        return reduce(xor, remainders(self.crc, self.crc_width))

    @property
    def tail_bits(self) -> int:
        """Bits after the position: the low bit of SSI; or nE, nW and the CRC."""
        return 2 + self.crc_width if self.biss else 1

    @property
    def frame_bits(self) -> int:
        """Bits from the first one of the position to the end of the frame."""
        return self.width + self.tail_bits

    @property
    def sent_bits(self) -> int:
        """Bits that an encoder sends, one for each rise of the clock: of BiSS-C four before and one after the frame."""
        return self.frame_bits + 5 if self.biss else self.frame_bits * (1 + self.repeat)

    @property
    def taken(self) -> int:
        """Clocks from the strobe that begins a read to the edge at which the encoder takes its position."""
        return 1 + self.half * self.biss

    @property
    def oldest(self) -> int:
        """Greatest `sample_age`, in clocks."""
        if self.biss:  # start bit and CDS are before the frame
            return self.start_wait + 2 * self.half * (self.frame_bits + 1)
        return self.delay + SYNCHRONISER + 2 * self.half * self.sent_bits + 1

    @property
    def age_width(self) -> int:
        """Bits of `sample_age`."""
        return self.oldest.bit_length()

    @property
    def age_spread(self) -> int:
        """Clocks by which ages differ, at most."""
        return self.start_wait if self.biss else 0

    @property
    def longest(self) -> int:
        """Clocks from the strobe that begins a read to the one that ends it, at most."""
        return self.taken + self.oldest

    @property
    def rest(self) -> int:
        """Clocks from the strobe that ends a read until another one can begin."""
        return 2 * self.half + self._clocks_of_ns(20_000 if self.biss else 25_000) + 2

    @property
    def least_tick(self) -> int:
        """Fewest clocks from read to read."""
        return self.longest + self.rest + 1
