"""Scale of the velocity of a core: what an LSB is, and how the port's is computed from counts per tick."""

import math
from fractions import Fraction
from typing import Any

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.formats.low_pass import LowPass
from tachometry.spec.formats.velocity_output import NATIVE, VelocityOutput
from tachometry.spec.formats.velocity_output import per_count as of_a_count
from tachometry.spec.language.units import SpeedUnit


class Scale(Follows[S]):
    """Says how much an LSB of the velocity is, and how it is computed from counts per tick."""

    @property
    def per_count(self) -> Fraction:
        """One count per tick in the unit."""
        return of_a_count(self.spec.unit, self.spec.encoder.counts_per_rev, self.spec.timing.tick_seconds)

    @property
    def lsb_per_count(self) -> Fraction:
        """One count per tick in LSB of `velocity`."""
        return self.per_count * Fraction(2) ** self.spec.widths.frac_bits

    @property
    def unit_velocity(self) -> float:
        """ω_u = 2π/(P·T_s) in rad/s, one count per tick (Tsuji 2009, Sec. V-A)."""
        return 2 * math.pi / float(self.spec.encoder.counts_per_rev * self.spec.timing.tick_seconds)

    @property
    def rad_per_s_per_lsb(self) -> float:
        """Value of one LSB of `velocity` in rad/s."""
        return float(self.unit_velocity / self.lsb_per_count)

    @property
    def shown_unit(self) -> SpeedUnit:
        """The unit in which commands show speeds; rad/s for counts per tick, which depend on the tick."""
        return SpeedUnit("rad/s" if self.spec.unit == NATIVE else self.spec.unit)

    @property
    def output(self) -> VelocityOutput | None:
        """How `velocity` is computed from the native velocity; None if the native velocity is the output."""
        widths = self.spec.widths
        if self.spec.unit == NATIVE and widths.velocity == widths.native:
            return None
        return self.of_width(widths.velocity)

    def of_width(self, width: int) -> VelocityOutput:
        """Return how a velocity of so many bits is computed."""
        widths = self.spec.widths
        native = 1 << widths.native_frac_bits
        largest = self.spec.bound.absent if self.spec.bounds else widths.max_velocity * native
        return VelocityOutput(self.lsb_per_count / native, largest, width, self.spec.bounds)

    @property
    def _greatest(self) -> int:
        return self.spec.widths.max_velocity << self.spec.widths.native_frac_bits

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
        counted = self.spec.widths.max_velocity * self.unit_velocity
        output = self.output
        return counted if output is None else min(counted, output.limit * self.rad_per_s_per_lsb)

    @property
    def rounding_lsb(self) -> float:
        """Most that rounding takes from `velocity` or adds to it, in its LSB."""
        return 0.5 if self.spec.unit == NATIVE else 0.7

    @property
    def entries(self) -> dict[str, dict[str, Any]]:
        """Entries of the manifest that say how outputs of this method alone are read, by the names of the ports."""
        return {}

    @property
    def over_speed(self) -> int:
        """The greatest |velocity|, in its LSB, that is not beyond `over_speed`, for a core that has it."""
        spec = self.spec
        assert spec.over_speed is not None
        counts = spec.over_speed.counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds)
        return math.floor(counts * self.per_count * 2**spec.widths.frac_bits)

    @property
    def low_pass(self) -> LowPass:
        """The low-pass filter, for a core that has one."""
        spec = self.spec
        assert spec.lowpass is not None
        # The ticks of updates that wait for the filter add up, at most one in each clock of the filter.
        longest = max((1 << spec.timing.max_ticks.bit_length()) - 1, 255)
        return LowPass(spec.lowpass * spec.timing.tick_seconds, longest, spec.widths.native)
