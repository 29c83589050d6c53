"""The electrical angle: exact for every count, and carried on between them with velocity and acceleration."""

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

SHOWN_BITS = 16  # of the angle: 2^16 is an electrical turn
SLOPE_BITS = 16  # bits of an acceleration below those of an angle
PLACE_BITS = 12  # bits of the counts between the fine position and the position
LEAD_BITS = 16  # of a lead, in clocks
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
        exponent = value.numerator.bit_length() - value.denominator.bit_length()
        number, shift = round(value * Fraction(2) ** (bits - 1 - exponent)), exponent + 1
        return cls(round(number / 2), bits, shift + 1) if number >> bits - 1 else cls(number, bits, shift)

    def term(self, value: int) -> int:
        """Return the term of a value."""
        return value << self.shift if self.shift >= 0 else value >> -self.shift

    def times(self, value: int) -> int:
        """Return a rounded product."""
        return rounded(self.term(value) * self.number, self.bits)


def rounded(product: int, bits: int) -> int:
    """Return a product without its lowest bits."""
    return product + (1 << bits - 1) >> bits


@dataclass(frozen=True)
class Angles:
    """Angles are fractions of an electrical turn, in 2^-N, modulo 2^N."""

    counts: int  # in a turn
    pole_pairs: int
    tick: int  # clocks of a nominal tick
    longest: int  # clocks of the longest tick

    @property
    def bits(self) -> int:
        """N: the slope of a phase, an angle a clock, is off by little in the longest tick."""
        return min(max(28, 18 + self.longest.bit_length()), 32)

    @property
    def zero(self) -> int:
        """Angle of no counts: half of an LSB of what is shown, so that this is rounded."""
        return 1 << self.bits - SHOWN_BITS - 1

    @property
    def per_count(self) -> Fraction:
        """The angle of a count."""
        return Fraction(self.pole_pairs << self.bits, self.counts)

    @property
    def count(self) -> tuple[int, int]:
        """The angle that a count adds, and its remainder in 1/counts."""
        return divmod(self.pole_pairs << self.bits, self.counts)

    @property
    def spread(self) -> int:
        """A debt falls by 2^-spread of it a clock; 2^spread is the greatest power of two within an eighth of a tick."""
        return max(1, self.tick // 8).bit_length() - 1


@dataclass(frozen=True)
class Tracked:
    """Formats of a method that tracks the place of the shaft."""

    position_fine_bits: int  # fraction bits of the fine position
    slope: Fraction  # LSB of the acceleration, in counts per clock²
    block: bool  # whether a multiplier of the FPGA makes products


@dataclass(frozen=True)
class Carried:
    """How the place of a tracking update becomes a phase, new in every clock."""

    angles: Angles
    tracked: Tracked
    velocity_bits: int  # fraction bits of the velocity, in counts per tick
    late: int  # clocks from the end of a tick at the pins to the update
    shows: int = 0  # clocks from a phase to what shows it

    PRODUCTS = 6

    @property
    def factor_bits(self) -> int:
        """Bits of a signed factor: times are at most half of a tick, the latency and a lead."""
        most = self.late + 256 + (1 << LEAD_BITS) + self.angles.tick // 2
        return max(_FACTOR_BITS, most.bit_length() + 1)

    @property
    def product_clocks(self) -> int:
        """Clocks of a product: to load it, a bit of a factor each or two in all, and to add and keep it."""
        return 4 if self.tracked.block else self.factor_bits + 3

    @property
    def clocks(self) -> int:
        """Clocks from an update to the first one of its phase."""
        return self.PRODUCTS * self.product_clocks + 1

    @property
    def span(self) -> int:
        """Clocks from the end of a tick to the first one that shows its phase."""
        return self.late + self.clocks + self.shows

    @cached_property
    def fine(self) -> Factor:
        """An LSB of the fine position, as an angle."""
        return Factor.of(self.angles.per_count / (1 << self.tracked.position_fine_bits), self.factor_bits)

    @cached_property
    def velocity(self) -> Factor:
        """An LSB of the velocity, as an angle a clock."""
        return Factor.of(self.angles.per_count / (self.angles.tick << self.velocity_bits), self.factor_bits)

    @cached_property
    def acceleration(self) -> Factor:
        """An LSB of the acceleration, in 2^-`SLOPE_BITS` of an angle per clock²."""
        return Factor.of(self.angles.per_count * self.tracked.slope * (1 << SLOPE_BITS), self.factor_bits)

    def phase(self, at: int, fine: int, velocity: int, acceleration: int, lead: int) -> tuple[int, int]:
        """Return the phase of an update in its first clock, and how much it grows in a clock; neither is wrapped.

        `at` is the angle of the counts at the end of the tick, `fine` the fine position less the position.
        """
        s, bits, slope = self.span + lead, self.factor_bits, self.velocity.times(velocity)
        curve = self.acceleration.times(acceleration) << bits - SLOPE_BITS
        mean = slope + rounded(curve * ((s >> 1) - self.late), bits)
        now = slope + rounded(curve * (s + (self.angles.tick >> 1) - self.late), bits)
        return at + self.fine.times(fine) + mean * s, now


def wrapped(angle: int, bits: int) -> int:
    """Return an angle as a signed number."""
    half = 1 << bits - 1
    return (angle + half) % (2 * half) - half


@dataclass(frozen=True)
class Counted:
    """How a count and the velocity become a phase, new in every clock: the place is at an edge after each count."""

    angles: Angles
    velocity_bits: int  # fraction bits of the velocity, in counts per tick
    late: int  # clocks from the pins to the angle of a count
    block: bool  # whether a multiplier of the FPGA makes products

    PRODUCTS = 2

    @property
    def factor_bits(self) -> int:
        """Bits of a signed factor: a time is at most the latency and a lead."""
        return max(_FACTOR_BITS, (self.late + (1 << LEAD_BITS)).bit_length() + 1)

    @property
    def clocks(self) -> int:
        """Clocks from an update to its slope in the phase."""
        return self.PRODUCTS * (4 if self.block else self.factor_bits + 3) + 1

    @property
    def half(self) -> int:
        """The angle of half a count, the furthest place from a position."""
        return self.angles.count[0] >> 1

    @cached_property
    def velocity(self) -> Factor:
        """An LSB of the velocity, as an angle a clock."""
        return Factor.of(self.angles.per_count / (self.angles.tick << self.velocity_bits), self.factor_bits)

    def carried(self, velocity: int, lead: int) -> tuple[int, int]:
        """Return how much the place grows in a clock, at most half a count, and how far the phase is ahead of it."""
        slope = self.velocity.times(velocity)
        return max(min(slope, self.half), -self.half), slope * (self.late + lead)
