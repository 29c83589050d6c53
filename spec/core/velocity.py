"""The velocity of a core: what encloses the true speed, its bits, its LSB, and how the port's is computed."""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Self

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.tick import Scale
from tachometry.spec.formats.low_pass import LowPass
from tachometry.spec.formats.velocity_output import NATIVE, VelocityOutput, per_count
from tachometry.spec.language.units import ceil_log2, signed_width

MAX_NATIVE_FRAC_BITS = 24  # as a rule


@dataclass(frozen=True)
class Bound:
    """How far the shaft may have gone beside what was counted."""

    edge_error: Fraction  # E in counts, in eighths
    max: int  # largest bound in counts per tick, rounded up

    @classmethod
    def of(cls, asked: Asked, counts: int, periods: int = 1) -> Self:
        """Return the bound where an edge error counts for as many timer periods, and without one it is `counts`."""
        error = Fraction(math.ceil(8 * asked.edge_error), 8)
        return cls(error, counts + math.ceil(error * periods))

    @property
    def error_bits(self) -> int:
        """Fraction bits of a number of counts to which the edge error is added."""
        return self.edge_error.denominator.bit_length() - 1

    @property
    def uncertainty(self) -> Fraction:
        """A shaft may have travelled as many counts more or less than were counted in a window, exclusive."""
        return 1 + self.edge_error


@dataclass(frozen=True)
class Velocity:
    """The velocity, in counts per tick (native) and at the port."""

    asked: Asked
    scale: Scale
    bound: Bound
    max: int  # greatest velocity in counts per tick
    most_native_frac_bits: int = MAX_NATIVE_FRAC_BITS  # most fraction bits of the velocity in counts per tick
    wished_frac_bits: int | None = None  # fraction bits that show what the method tells apart, if it differs from most
    more_rounding: float = 0  # LSB by which the method rounds, beside the unit
    least_native_frac_bits: int = 4

    @property
    def width(self) -> int:
        """Bits of `velocity`."""
        asked = self.asked.velocity_width
        return self.needed_width if asked is None else asked

    @property
    def needed_width(self) -> int:
        """Bits with which `velocity` never saturates."""
        return self.native if self.asked.unit == NATIVE else signed_width(self._of_width(0).greatest)

    @cached_property
    def frac_bits(self) -> int:
        """Fraction bits of `velocity`."""
        if self.asked.frac_bits is not None:
            return self.asked.frac_bits
        coarsest, finest = self.frac_bits_range(self.asked.unit)
        wished = self.wished_frac_bits
        most = min((16 if self.asked.unit == NATIVE else 10) if wished is None else wished, finest)
        if self.asked.max_speed is not None and self.asked.velocity_width is not None:
            # With them no velocity saturates.
            most = min(most, self.fitting_frac_bits(self.max))
        return max(coarsest, most)

    def fitting_frac_bits(self, counts: Fraction | int) -> int:
        """Return the most fraction bits with which a velocity in counts per tick fits `velocity`."""
        lsb = counts * self.scale.per_count / ((1 << (self.width - 1)) - 1)
        return -ceil_log2(lsb)

    def frac_bits_range(self, unit: str) -> tuple[int, int]:
        """Return fewest and most fraction bits of the velocity in `unit`."""
        if unit == NATIVE:
            return self.least_native_frac_bits, self.most_native_frac_bits
        # The greatest speed must be at least one LSB, and one count per tick at most 2^22.
        count = per_count(unit, self.asked.encoder.counts_per_rev, self.asked.timing.tick_seconds)
        return 1 - ceil_log2(count * self.max), self.most_native_frac_bits - 2 - ceil_log2(count)

    @property
    def native(self) -> int:
        """Bits of the velocity in counts per tick."""
        return signed_width(self.max) + self.native_frac_bits

    @property
    def native_frac_bits(self) -> int:
        """Fraction bits of the velocity in counts per tick, from which that in another unit is computed."""
        if self.asked.unit == NATIVE:
            return self.frac_bits
        return max(self.least_native_frac_bits, ceil_log2(self.lsb_per_count) + 2)

    @property
    def lsb_per_count(self) -> Fraction:
        """One count per tick in LSB of `velocity`."""
        return self.scale.per_count * Fraction(2) ** self.frac_bits

    @property
    def rad_per_s_per_lsb(self) -> float:
        """Value of one LSB of `velocity` in rad/s."""
        return float(self.scale.unit_velocity / self.lsb_per_count)

    @property
    def rounding_lsb(self) -> float:
        """Most that rounding takes from `velocity` or adds to it, in its LSB."""
        return (0.5 if self.asked.unit == NATIVE else 0.7) + self.more_rounding

    @property
    def output(self) -> VelocityOutput | None:
        """How `velocity` is computed from the native velocity; None if the native velocity is the output."""
        if self.asked.unit == NATIVE and self.width == self.native:
            return None
        return self._of_width(self.width)

    def _of_width(self, width: int) -> VelocityOutput:
        """Return how a velocity of this width is computed."""
        largest = self.absent_bound if self.asked.bounds else self._greatest
        return VelocityOutput(self.lsb_per_count / (1 << self.native_frac_bits), largest, width, self.asked.bounds)

    @property
    def _greatest(self) -> int:
        return self.max << self.native_frac_bits

    @property
    def full_scale(self) -> int:
        """The greatest |velocity|, in its LSB: there it saturates."""
        output = self.output
        return self._greatest if output is None else min(output.scaled(self._greatest), output.limit)

    @property
    def narrow(self) -> bool:
        """Whether a measured velocity can exceed what the bits of `velocity` hold."""
        output = self.output
        return output is not None and output.scaled(self._greatest) > output.limit

    @property
    def greatest_speed(self) -> float:
        """Greatest speed, in rad/s, that `velocity` can show; ticks are as long as nominal."""
        counted = self.max * self.scale.unit_velocity
        output = self.output
        return counted if output is None else min(counted, output.limit * self.rad_per_s_per_lsb)

    @property
    def bound_width(self) -> int:
        """Bits of a bound in counts per tick."""
        return signed_width(self.bound.max) + self.native_frac_bits

    @property
    def absent_bound(self) -> int:
        """Magnitude of an absent bound in counts per tick: the greatest that fits."""
        return (1 << (self.bound_width - 1)) - 1

    @property
    def shown_absent(self) -> int:
        """Magnitude of an absent bound at the ports: −limit for `velocity_lower`, limit for `velocity_upper`."""
        output = self.output
        return self.absent_bound if output is None else output.limit

    @property
    def low_pass(self) -> LowPass:
        """The low-pass filter, for a core that has one."""
        asked = self.asked
        assert asked.lowpass is not None
        # The ticks of updates that wait for the filter add up, at most one in each clock of the filter.
        longest = max((1 << asked.timing.max_ticks.bit_length()) - 1, 255)
        return LowPass(asked.lowpass * asked.timing.tick_seconds, longest, self.native)
