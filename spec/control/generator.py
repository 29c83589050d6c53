"""Numbers of the command generator: what it counts in, and how exact it is.

At each control tick it makes a step, and all that it shows are sums of what it shows:

    ω ← ω + α,   θ ← θ + ω,   in 2^−F counts, counts per control tick, and counts per control tick squared.

So the velocity is how far the position has gone since the control tick before, and the acceleration by how much the
velocity has changed, in every bit. The modes say what α is:

- constant: what takes ω to the wanted velocity at once;
- ramp: the same, but no more than the acceleration;
- sine: c·x, where x is the way to the middle: x ← x − ω. Then x(k) = R·cos((k + ½)·φ) with 2·sin(φ/2) = √c.

The last is a recurrence whose steps can be undone: x(k−1) is 2·x(k) − x(k+1) − round(c·x(k)), the same formula as
forward. So there is no amplitude to which it decays or grows, whatever is rounded. It begins at rest at one end, so
R = amplitude/cos(φ/2), which is at most 0.2 % more than the amplitude.

The sums of the position are exact; the velocity and the acceleration that go to the controller are in other units, by
a product and a rounding each, off by at most ½ LSB and 1/16 of one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.control.form import ACCELERATION_WIDTH, POSITION_FRAC_BITS
from tachometry.spec.control.units import Units
from tachometry.spec.language.units import PI

CONSTANT, RAMP, SINE = 0, 1, 2  # modes; 3 is a sine, too
MODE_WIDTH = 2
WORD = 32  # bits of velocity, acceleration and rate
AMPLITUDE_WIDTH = 28  # bits, in 2^−8 counts
RATE_FRAC_BITS = 38  # so c is less than 2^−6
FACTOR_BITS = 32  # of every product
MOST_FRACTION = 36
_SCALE_BITS = 28  # of the factor of a scale
# Clocks of the three products and of what is between them.
_SERIAL, _PARALLEL = 3 * (FACTOR_BITS + 1) + 5, 3 * 3 + 5


@dataclass(frozen=True)
class Scale:
    """Converts the generator's unit to that of a port: round((word·2^−shift)·factor/2^32); a shift rounds down."""

    factor: int  # of 28 bits, so the word keeps four more than the port shows
    shift: int  # less than 0: to the left

    @classmethod
    def of(cls, ratio: Fraction) -> Scale:
        """Return that of a ratio."""
        shift = _SCALE_BITS - FACTOR_BITS + math.floor(-math.log2(ratio))
        return cls(round(ratio * Fraction(2) ** (shift + FACTOR_BITS)), shift)


@dataclass(frozen=True)
class GeneratorForm:
    """Holds the numbers that hardware and golden model share."""

    fraction: int  # F
    position_width: int  # bits of the position, in counts
    velocity_bits: int  # |ω| is less than 2^this
    velocity_shift: int  # the wanted velocity is in 2^(this − F) counts per control tick
    velocity: Scale
    acceleration: Scale
    # command_width and acceleration_width: bits of the commanded velocity and acceleration
    command_width: int
    acceleration_width: int

    @property
    def place_width(self) -> int:
        """Bits of θ."""
        return self.position_width + self.fraction

    @property
    def most_velocity(self) -> int:
        """Greatest |ω|."""
        return (1 << self.velocity_bits) - 1

    @property
    def amplitude_shift(self) -> int:
        """From a unit of the amplitude to one of x."""
        return self.fraction - POSITION_FRAC_BITS

    @property
    def most_away(self) -> int:
        """Greatest |x|: twice the greatest amplitude."""
        return (1 << (AMPLITUDE_WIDTH + self.amplitude_shift)) - 1

    @property
    def away_shift(self) -> int:
        """Bits of x below what is multiplied by the rate."""
        return RATE_FRAC_BITS - FACTOR_BITS

    @property
    def _away_word(self) -> int:
        """Bits of x that are multiplied by the rate."""
        return self.most_away.bit_length() + 1 - self.away_shift

    @property
    def change_width(self) -> int:
        """Bits of α: of what is to be gone, or of c·x."""
        return max(self.velocity_bits + 2, self._away_word + 1)

    @property
    def word_width(self) -> int:
        """Bits of a word that is multiplied."""
        speed, change = self.velocity_bits + 1, self.change_width
        return max(self._away_word, speed - self.velocity.shift, change - self.acceleration.shift)


def generator_form(units: Units, command_width: int) -> GeneratorForm:
    """Return the numbers of the generator of a loop, whose commanded velocity has so many bits."""
    core = units.law.tachometer
    count = 2 * PI / core.encoder.counts_per_rev  # rad
    speed = count / units.seconds  # a count per control tick in rad/s
    change = speed / units.seconds
    acceleration = Fraction(2) ** -units.acceleration_frac_bits
    greatest = acceleration * (1 << (ACCELERATION_WIDTH - 1)) / change
    fraction = math.floor(math.log2((1 << (WORD - 1)) / greatest))
    fraction = max(POSITION_FRAC_BITS, min(fraction, MOST_FRACTION))
    fastest = units.rad_per_s * core.velocity.full_scale / speed * (1 << fraction)
    bits = max(WORD - 1, math.ceil(fastest).bit_length())
    velocity = units.rad_per_s / (1 << units.command_bits)
    return GeneratorForm(
        fraction=fraction,
        position_width=core.position_width,
        velocity_bits=bits,
        velocity_shift=bits - (WORD - 1),
        velocity=Scale.of(speed / (1 << fraction) / velocity),
        acceleration=Scale.of(change / (1 << fraction) / acceleration),
        command_width=command_width,
        acceleration_width=ACCELERATION_WIDTH,
    )


def generator_clocks(multiplier: str) -> int:
    """Return fewest clocks between two control ticks."""
    return _SERIAL if multiplier == "serial" else _PARALLEL
