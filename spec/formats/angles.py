"""The electrical angle: exact for every count, and carried on between them with velocity and acceleration."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tachometry.spec.formats.velocity_output import VelocityOutput

SHOWN_BITS = 16  # of the angle: 2^16 is an electrical turn
LEAD_BITS = 16  # of a lead, in clocks
PLACE_BITS = 8  # bits of the counts between the fine position and the position
_FACTOR_BITS = 18  # of a factor, with its sign, or more where times need them


@dataclass(frozen=True)
class Factor:
    """A constant: a term is shifted, multiplied by `number`, and shifted down by `bits`, rounded."""

    number: int
    bits: int  # of the number, with a sign
    shift: int  # of the term, upwards

    @classmethod
    def of(cls, value: Fraction, bits: int) -> "Factor":
        """Return a constant, with the greatest number that has so many bits with its sign."""
        shift = math.floor(math.log2(value)) + 2
        return cls(min(round(value * Fraction(2) ** (bits - shift)), (1 << bits - 1) - 1), bits, shift)

    def term(self, value: Any) -> Any:
        """Return the term of a number, or of a signal."""
        return value << self.shift if self.shift >= 0 else value >> -self.shift

    def times(self, value: int) -> int:
        """Return a rounded product."""
        return self.term(value) * self.number + (1 << self.bits - 1) >> self.bits


def clocks_of_product(bits: int, *, block: bool) -> int:
    """Return the clocks that a product by a factor of so many bits takes."""
    return 4 if block else bits + 3


@dataclass(frozen=True)
class Angles:
    """How counts and updates become a phase that is new in every clock: fractions of an electrical turn, in 2^-N."""

    counts: int  # in a turn
    pole_pairs: int
    tick: int  # clocks of a nominal tick
    longest: int  # clocks of the longest tick
    velocity_bits: int  # fraction bits of the velocity, in counts per tick
    late: int  # clocks from a count to its angle; with `tracks`, from the end of a tick to the velocity
    # of method track: clocks from a tick to its update, or 0; fraction bits of the place, and LSB of the acceleration
    tracks: int
    position_fine_bits: int
    slope: Fraction  # in counts per clock²
    cycle: tuple[int, ...] = ()  # levels of halls, in the order of the counts
    block: bool = False  # whether a multiplier of the FPGA computes products
    led: VelocityOutput | None = None  # of `velocity_lead`; None: there is none
    once: bool = False  # whether a phase is that of one clock, and does not grow
    place_bits: int = PLACE_BITS  # bits of the counts between the fine position and the position
    is_read: bool = False  # whether the place within a turn is read
    rest: int = 0  # clocks from the velocity of an update to the rest of it

    @property
    def bits(self) -> int:
        """N: the slope of a phase, an angle a clock, is off by little in the longest tick."""
        return min(max(28, 18 + self.longest.bit_length()), 32)

    @property
    def count(self) -> tuple[int, int]:
        """The angle that a count adds, and its remainder in 1/counts."""
        return divmod(self.pole_pairs << self.bits, self.counts)

    @property
    def spread(self) -> int:
        """A debt falls by 2^-spread of it a clock; 2^spread is the greatest power of two within an eighth of a tick."""
        return max(1, self.tick // 8).bit_length() - 1

    @property
    def factor_bits(self) -> int:
        """Bits of a signed factor: times are at most half of a tick, the latency and a lead."""
        most = self.late + self.rest + 256 + (1 << LEAD_BITS) + (self.tick // 2 if self.tracks else 0)
        return max(_FACTOR_BITS, most.bit_length() + 1)

    @property
    def clocks(self) -> int:
        """Clocks from an update to the first one of its phase."""
        return (6 - self.once if self.tracks else 2) * self.product + 1

    @property
    def all_clocks(self) -> int:
        """Clocks from an update until all products are there, also those of a lead."""
        return self.clocks + (6 * self.product if self.led else 0)

    @property
    def product(self) -> int:
        """Clocks of a product."""
        return clocks_of_product(self.factor_bits, block=self.block)

    @property
    def span(self) -> int:
        """Clocks from the pins to the first clock in which the port shows the phase of a place."""
        return self.late + self.rest + (self.clocks + 1 if self.tracks else 2)

    @property
    def factors(self) -> tuple[Factor, ...]:
        """LSBs as angles: velocity, per clock, fine position, acceleration, per clock² and finer by `factor_bits`."""
        lsb = (Fraction(1, self.tick << self.velocity_bits), Fraction(1, 1 << self.position_fine_bits), self.slope)
        per_count = Fraction(self.pole_pairs << self.bits, self.counts)
        values = (lsb[0] * per_count, lsb[1] * per_count, (lsb[2] or 1) * per_count * (1 << self.factor_bits))
        return tuple(Factor.of(value, self.factor_bits) for value in values)

    @property
    def lead_factors(self) -> tuple[Factor, ...]:
        """LSBs: of an acceleration in those of a velocity, that in those of a fine position, per clock, and `led`."""
        per_tick, fine = self.tick << self.velocity_bits, 1 << self.position_fine_bits
        shown = self.led.ratio if self.led else self.slope
        finer = 1 << self.factor_bits
        values = (self.slope * per_tick * finer, Fraction(fine * finer, per_tick), shown)
        return tuple(Factor.of(value, self.factor_bits) for value in values)

    @property
    def states(self) -> dict[int, int]:
        """The angle at each of the levels of halls."""
        return {levels: self.of(place) for place, levels in enumerate(self.cycle)}

    def of(self, counts: int) -> int:
        """Return the angle of counts since the zero, and half of an LSB of what is shown, so that this is rounded.

        With halls, the zero is an edge, and the angle the middle of a sixth.
        """
        turn = (2 * counts + bool(self.cycle)) * self.pole_pairs << self.bits
        return (turn // (2 * self.counts) + (1 << self.bits - SHOWN_BITS - 1)) % (1 << self.bits)
