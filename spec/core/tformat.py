"""Reads of an absolute encoder with T-format, of Tamagawa: its frames, and times in clocks of the core."""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import ClassVar

from tachometry.spec.core.reads import ERROR_BIT, NO_ANSWER, SYNCHRONISER, WARNING, WRONG_CHECK, Reads
from tachometry.spec.language.port import Port, pin

RATES = (2_500_000, 5_000_000)  # bits a second
REQUEST = 0x1A  # data identifier 3: status, place, identification, turns, alarms
CHARACTER, N_CHARACTERS = 10, 11  # bits with start and stop; characters of an answer, the last the XOR of the others
STATUS, PLACE, TURNS = 1, 2, 6  # characters; those of places and turns are three, the lowest first
IDENTITY = 0x17  # the character before those of turns, of an encoder of 17 bits
MOST_BITS = 24  # of places and turns
# Bits of the status: a counting error, or an error of the request; another alarm.
ERRORS, WARNINGS = 0b1101_0000, 0b0010_0000


@dataclass(frozen=True)
class TformatReads(Reads):
    """The reads of an encoder with T-format: a character is a request, which 11 characters answer."""

    turn_bits: int = 0
    characters: int = N_CHARACTERS  # of an answer

    ports: ClassVar = (
        pin("rs485_rx", "Data of the encoder, asynchronous; it is high between characters."),
        Port("rs485_tx", "output", help="Request to the encoder; it is high between requests."),
        Port("rs485_de", "output", help="High while rs485_tx drives the line."),
    )

    reasons: ClassVar = (NO_ANSWER, WRONG_CHECK, ERROR_BIT, WARNING)

    def within(self, tick: int, longest_tick: int) -> "TformatReads":
        left = tick - self.least_tick
        return replace(self, start_wait=max(min(self._clocks_of_ns(10_000), left), self._clocks_of_ns(4_000)))

    @property
    def bit(self) -> int:
        """Clocks of a bit."""
        return round(Fraction(self.clock_hz, self.encoder_hz))

    @property
    def half(self) -> int:
        return self.bit // 2

    @property
    def is_exact(self) -> bool:
        # The last bit of a character is read at most a quarter of a bit from its middle.
        return abs(Fraction(self.clock_hz, self.encoder_hz) - self.bit) * (CHARACTER - 1) + 1 <= Fraction(self.bit, 4)

    @property
    def taken(self) -> int:
        return 1 + CHARACTER * self.bit

    @property
    def last_start(self) -> int:
        """Clocks from the request in which the last start bit must come; `start_wait` is all that is waited."""
        return self.start_wait + self.delay + SYNCHRONISER + CHARACTER * (self.characters - 1) * self.bit

    @property
    def oldest(self) -> int:
        return self.last_start + self.half + (CHARACTER - 1) * self.bit + 1

    @property
    def age_spread(self) -> int:
        return self.oldest - CHARACTER * (self.characters - 1) * self.bit

    @property
    def longest(self) -> int:
        return self.taken + self.oldest

    @property
    def pause(self) -> int:
        """Clocks between request and answer, as a rule."""
        return self._clocks_of_ns(3_000)

    @property
    def rest(self) -> int:
        return self.pause + 2
