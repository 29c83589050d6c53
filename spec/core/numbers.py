"""Widths, formats and latencies follow from the parameters of a core."""

import math
from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.core.parameters import Parameters
from tachometry.spec.formats.low_pass import LowPass
from tachometry.spec.formats.velocity_output import NATIVE, VelocityOutput
from tachometry.spec.formats.velocity_output import per_count as of_a_count
from tachometry.spec.language.option import is_derived
from tachometry.spec.language.units import SpeedUnit, ceil_log2, signed_width

MAX_NATIVE_FRAC_BITS = 24


@dataclass(frozen=True, kw_only=True)
class Numbers(Parameters):
    """Parameters, and the numbers that hardware, golden models and manifest take from them."""

    @property
    def default_frac_bits(self) -> int:
        """Fraction bits of the velocity if they are not given."""
        coarsest, finest = self.frac_bits_range(self.unit)
        most = 16 if self.unit == NATIVE else min(10, finest)
        if self.max_speed is not None and not is_derived(self.velocity_width):
            # With them no velocity saturates.
            most = min(most, self.fitting_frac_bits(self.max_velocity))
        return max(coarsest, most)

    def fitting_frac_bits(self, counts: Fraction | int) -> int:
        """Return the most fraction bits with which so many counts per tick fit `velocity_width`."""
        lsb = counts * self.per_count / ((1 << (self.velocity_width - 1)) - 1)
        return -ceil_log2(lsb)

    def frac_bits_range(self, unit: str) -> tuple[int, int]:
        """Return fewest and most fraction bits of the velocity in `unit`."""
        if unit == NATIVE:
            return 4, MAX_NATIVE_FRAC_BITS
        # The greatest speed must be at least one LSB, and one count per tick at most 2^22.
        count = of_a_count(unit, self.encoder.counts_per_rev, self.timing.tick_seconds)
        return 1 - ceil_log2(count * self.max_velocity), MAX_NATIVE_FRAC_BITS - 2 - ceil_log2(count)

    @property
    def native_frac_bits(self) -> int:
        """Fraction bits of the velocity in counts per tick, from which that in another unit is computed."""
        if self.unit == NATIVE:
            return self.frac_bits
        return max(4, ceil_log2(self._lsb_per_count) + 2)

    @property
    def max_velocity(self) -> int:
        """Greatest velocity in counts per tick: a mean of pulse numbers never exceeds the largest of them."""
        return self.max_count

    @property
    def native_width(self) -> int:
        """Bits of the velocity in counts per tick."""
        return signed_width(self.max_velocity) + self.native_frac_bits

    @property
    def output(self) -> VelocityOutput | None:
        """How `velocity` is computed from the native velocity; None if the native velocity is the output."""
        if self.unit == NATIVE and self.velocity_width == self.native_width:
            return None
        return self._output(self.velocity_width)

    def _output(self, width: int) -> VelocityOutput:
        native = 1 << self.native_frac_bits
        largest = self.absent_bound if self.bounds else self.max_velocity * native
        return VelocityOutput(self._lsb_per_count / native, largest, width, self.bounds)

    @property
    def needed_velocity_width(self) -> int:
        """Bits with which `velocity` never saturates."""
        return self.native_width if self.unit == NATIVE else signed_width(self._output(0).greatest)

    @property
    def full_scale(self) -> int:
        """The greatest |velocity|, in its LSB: there it saturates."""
        greatest = self.max_velocity << self.native_frac_bits
        return greatest if self.output is None else min(self.output.scaled(greatest), self.output.limit)

    @property
    def narrow(self) -> bool:
        """Whether a measured velocity can exceed what `velocity_width` bits hold."""
        output = self.output
        return output is not None and output.scaled(self.max_velocity << self.native_frac_bits) > output.limit

    @property
    def shown_unit(self) -> SpeedUnit:
        """The unit in which commands show speeds; rad/s for counts per tick, which depend on the tick."""
        return SpeedUnit("rad/s" if self.unit == NATIVE else self.unit)

    @property
    def max_bound(self) -> int:
        """Largest bound in counts per tick, rounded up: a window may have missed a count at its ends."""
        return self.max_count + math.ceil(self.uncertainty)

    @property
    def uncertainty(self) -> Fraction:
        """A shaft may have travelled as many counts more or less than were counted in a window, exclusive."""
        return 1 + self.edge_error

    @property
    def error_bits(self) -> int:
        """Fraction bits of a number of counts to which `edge_error` is added."""
        return self.edge_error.denominator.bit_length() - 1

    @property
    def bound_width(self) -> int:
        """Bits of a bound in counts per tick."""
        return signed_width(self.max_bound) + self.native_frac_bits

    @property
    def absent_bound(self) -> int:
        """Magnitude that an absent bound has, in counts per tick: the greatest that fits."""
        return (1 << (self.bound_width - 1)) - 1

    @property
    def shown_absent_bound(self) -> int:
        """Magnitude of an absent bound at the ports: −limit for `velocity_lower`, limit for `velocity_upper`."""
        return self.absent_bound if self.output is None else self.output.limit

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates."""
        return self.timing.tick_cycles if self.max_tick_cycles is None else self.min_tick_cycles

    @property
    def per_count(self) -> Fraction:
        """One count per tick in the unit."""
        return of_a_count(self.unit, self.encoder.counts_per_rev, self.timing.tick_seconds)

    @property
    def _lsb_per_count(self) -> Fraction:
        return self.per_count * Fraction(2) ** self.frac_bits

    @property
    def low_pass(self) -> LowPass:
        """The low-pass filter, for a core that has one."""
        assert self.lowpass is not None
        # The ticks of updates that wait for the filter add up, at most one in each clock of the filter.
        longest = max((1 << self.timing.max_ticks.bit_length()) - 1, 255)
        return LowPass(self.lowpass * self.timing.tick_seconds, longest, self.native_width)

    @property
    def low_pass_latency(self) -> int:
        """Clocks from the measured velocity to the filtered one, if updates are no closer."""
        return 0 if self.lowpass is None else self.low_pass.latency

    @property
    def greatest_speed(self) -> float:
        """Greatest speed, in rad/s, that `velocity` can show; ticks are as long as nominal."""
        counted = self.max_velocity * self.unit_velocity
        return counted if self.output is None else min(counted, self.output.limit * self.rad_per_s_per_lsb)

    @property
    def rounding_lsb(self) -> float:
        """Most that rounding takes from `velocity` or adds to it, in its LSB."""
        return 0.5 if self.unit == NATIVE else 0.7

    @property
    def longest_tick(self) -> int:
        """Most clocks in a tick."""
        return self.timing.tick_cycles if self.max_tick_cycles is None else self.max_tick_cycles

    @property
    def min_tick_cycles(self) -> int:
        """Fewest clocks between two external ticks: all work that is done step by step must be finished."""
        output = self.output_latency if self.output_serial else 0
        return max(2, self.busy_clocks if self.serial else 0, output)

    def has_room(self, clocks: int) -> bool:
        """Tell whether a tick is long enough for work of so many clocks; external ones may come in half the time."""
        return self.timing.tick_cycles >= (clocks if self.max_tick_cycles is None else 2 * clocks)

    @property
    def pin_to_count(self) -> int:
        """Clocks from the sampling of a level to its step: the two synchroniser flip-flops and the filter."""
        return 2 + self.filter_clocks

    @property
    def max_count(self) -> int:
        """Largest |m_e|: ⌈max_speed/ω_u⌉, for the longest tick, at most one count per clock."""
        cycles = self.longest_tick
        if self.max_speed is None:
            return cycles
        return min(cycles, self.max_speed.ceil_counts(self.encoder.counts_per_rev, self.seconds(cycles)))

    @property
    def unit_velocity(self) -> float:
        """ω_u = 2π/(P·T_s) in rad/s, one count per tick (Tsuji 2009, Sec. V-A)."""
        return 2 * math.pi / float(self.encoder.counts_per_rev * self.timing.tick_seconds)

    @property
    def rad_per_s_per_lsb(self) -> float:
        """Value of one LSB of `velocity` in rad/s."""
        return float(self.unit_velocity / self._lsb_per_count)

    @property
    def max_pulse_count(self) -> int:
        """Largest |m_e| of the longest tick, less the time that a method with own ticks may wait for a count."""
        return self.max_count

    @property
    def count_width(self) -> int:
        """Bits of `pulse_count`."""
        return signed_width(self.max_pulse_count)

    @property
    def interval_width(self) -> int:
        """Bits of `interval`, unsigned."""
        return self.timing.max_ticks.bit_length()

    @property
    def interval_unit_cycles(self) -> int:
        """Clocks in one unit of `interval`."""
        return self.timing.tick_cycles

    @property
    def serial(self) -> bool:
        """Whether the datapath needs the time between two ticks."""
        raise NotImplementedError

    @property
    def datapath_latency(self) -> int:
        """Clocks from `tick` to the native velocity."""
        raise NotImplementedError

    @property
    def busy_clocks(self) -> int:
        """Clocks that a serial datapath needs from tick to tick."""
        return self.datapath_latency

    @property
    def output_serial(self) -> bool:
        """Whether `velocity` is computed from the native velocity bit by bit."""
        output = self.output
        return output is not None and len(output.digits) > 2 and self.has_room(output.serial_latency)

    @property
    def output_latency(self) -> int:
        """Clocks from the native velocity to `velocity`."""
        output = self.output
        if output is None:
            return 0
        return output.serial_latency if self.output_serial else output.pipelined_latency

    @property
    def tick_to_velocity(self) -> int:
        """Clocks from `tick` to `velocity_valid`."""
        return self.datapath_latency + self.low_pass_latency + self.output_latency

    def seconds(self, clocks: int) -> Fraction:
        """Return a number of clocks in seconds, exactly."""
        return Fraction(clocks, self.timing.clock_hz)
