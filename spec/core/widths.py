"""Widths of a core: the bits of its numbers, and the greatest of them."""

from fractions import Fraction

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.formats.velocity_output import per_count as of_a_count
from tachometry.spec.language.units import ceil_log2, signed_width

MAX_NATIVE_FRAC_BITS = 24  # as a rule


class Widths(Follows[S]):
    """Counts the bits of the numbers of a core, and finds the greatest of them."""

    @property
    def max_count(self) -> int:
        """Largest |m_e|: ⌈max_speed/ω_u⌉, for the longest tick, at most one count per clock."""
        spec = self.spec
        cycles = spec.times.longest_tick
        if spec.max_speed is None:
            return cycles
        return min(cycles, spec.max_speed.ceil_counts(spec.encoder.counts_per_rev, spec.times.seconds(cycles)))

    @property
    def max_pulse_count(self) -> int:
        """Largest |m_e| of the longest tick, less the time that a method with own ticks may wait for a count."""
        return self.max_count

    @property
    def max_velocity(self) -> int:
        """Greatest velocity in counts per tick: a mean of pulse numbers never exceeds the largest of them."""
        return self.max_count

    @property
    def count(self) -> int:
        """Bits of `pulse_count`."""
        return signed_width(self.max_pulse_count)

    @property
    def interval(self) -> int:
        """Bits of `interval`, unsigned."""
        return self.spec.timing.max_ticks.bit_length()

    @property
    def velocity(self) -> int:
        """Bits of `velocity`."""
        asked = self.spec.velocity_width
        return self.needed_velocity if asked is None else asked

    @property
    def frac_bits(self) -> int:
        """Fraction bits of `velocity`."""
        asked = self.spec.frac_bits
        return self._usual_frac_bits if asked is None else asked

    @property
    def _usual_frac_bits(self) -> int:
        """Fraction bits of the velocity if they are not given."""
        coarsest, finest = self.frac_bits_range(self.spec.unit)
        most = min(self._wished_frac_bits, finest)
        if self.spec.max_speed is not None and self.spec.velocity_width is not None:
            # With them no velocity saturates.
            most = min(most, self.fitting_frac_bits(self.max_velocity))
        return max(coarsest, most)

    @property
    def _wished_frac_bits(self) -> int:
        """Fraction bits that show what the method tells apart."""
        return 16 if self.spec.unit == NATIVE else 10

    def fitting_frac_bits(self, counts: Fraction | int) -> int:
        """Return the most fraction bits with which so many counts per tick fit `velocity`."""
        lsb = counts * self.spec.scale.per_count / ((1 << (self.velocity - 1)) - 1)
        return -ceil_log2(lsb)

    def frac_bits_range(self, unit: str) -> tuple[int, int]:
        """Return fewest and most fraction bits of the velocity in `unit`."""
        if unit == NATIVE:
            return 4, self.most_native_frac_bits
        # The greatest speed must be at least one LSB, and one count per tick at most 2^22.
        count = of_a_count(unit, self.spec.encoder.counts_per_rev, self.spec.timing.tick_seconds)
        return 1 - ceil_log2(count * self.max_velocity), self.most_native_frac_bits - 2 - ceil_log2(count)

    @property
    def most_native_frac_bits(self) -> int:
        """Most fraction bits of the velocity in counts per tick."""
        return MAX_NATIVE_FRAC_BITS

    @property
    def needed_velocity(self) -> int:
        """Bits with which `velocity` never saturates."""
        return self.native if self.spec.unit == NATIVE else signed_width(self.spec.scale.of_width(0).greatest)

    @property
    def native(self) -> int:
        """Bits of the velocity in counts per tick."""
        return signed_width(self.max_velocity) + self.native_frac_bits

    @property
    def native_frac_bits(self) -> int:
        """Fraction bits of the velocity in counts per tick, from which that in another unit is computed."""
        if self.spec.unit == NATIVE:
            return self.frac_bits
        return max(4, ceil_log2(self.spec.scale.lsb_per_count) + 2)

    @property
    def stamp(self) -> int:
        """Bits of the number of ticks that may fall between the cause of an update and the update; 0 without an age."""
        if not self.spec.age:
            return 0
        # An update may have to wait for the filter as long as this works.
        clocks = self.spec.latency.tick_to_velocity + self.spec.latency.low_pass
        ticks = -(-clocks // self.spec.times.shortest_tick) - (self.spec.facts.update_by != "count")
        return ticks.bit_length()
