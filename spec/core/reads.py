"""Reads of an absolute encoder by SSI or BiSS-C: frames, checks, and times in clocks of the core."""

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import reduce
from math import ceil
from operator import xor

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

    def within(self, tick_cycles: int) -> "Reads":
        """Return the same with a wait for the start bit, of at most 40 us, that leaves time for the rest of a tick."""
        left = tick_cycles - self.least_tick
        least = 4 * self.half + self.delay
        return replace(self, start_wait=max(min(self._clocks(40), left), least)) if self.biss else self

    def _clocks(self, microseconds: int) -> int:
        return ceil(Fraction(microseconds * self.clock_hz, 10**6))

    @property
    def half(self) -> int:
        """Clocks of half a period of the encoder's clock, at least two."""
        return max(ceil(Fraction(self.clock_hz, 2 * self.encoder_hz)), 2)

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
        return 2 * self.half + self._clocks(20 if self.biss else 25) + 2

    @property
    def least_tick(self) -> int:
        """Fewest clocks from read to read."""
        return self.longest + self.rest + 1
