"""Formats of the tracking recursion where positions are read: a count is 2^s LSB of the read.

So the words of places, velocity and acceleration are those of a disc of 8192 counts, and the s lower bits of a read are
fraction bits of the place.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from tachometry.spec.formats.tracking import GAIN_STEPS, GAINS, PLACE_BITS, Tracking, fixed_log

# What a program writes into an offset of the period.
EXCHANGED = ("offset_written", "offset_at", "offset_value")
OFFSET_BITS = 32
_CARRIED = 8  # ticks without a read for which the acceleration is still taken into account


@dataclass(frozen=True, kw_only=True)
class SampledTracking(Tracking):
    """Formats and constants of a tracking recursion of reads."""

    shift: int  # s
    most_moved: int  # most counts between two reads, in LSB
    most_age: int  # clocks
    max_ticks: int  # ticks without a read after which all is forgotten

    sampled = True
    kind_bits = 3
    PHASE_BITS: ClassVar[int] = 6  # of the place within an eighth of a period
    number_bits = 1

    @property
    def moved_shift(self) -> int:
        return PLACE_BITS - self.shift

    @property
    def moved_bits(self) -> int:
        return self.most_moved.bit_length() + 1

    @property
    def times_bits(self) -> int:
        return (self.most_age + self.longest_tick - 1).bit_length()

    @property
    def placed_bits(self) -> int:
        return self.PHASE_BITS + 1 if self.period_bits else super().placed_bits

    @cached_property
    def shifts(self) -> dict[str, int]:
        return super().shifts | {"mean": self.PHASE_BITS + 13}

    def phase(self, sample: Any) -> tuple[Any, Any]:
        """Return the eighth of a period in which a read is, and its place there, of an int or an array of them."""
        within, rest, more = sample & (1 << self.period_bits) - 1, self.period_bits - 3, self.PHASE_BITS
        fine = within & (1 << rest) - 1
        return within >> rest, fine >> rest - more if rest >= more else fine << more - rest

    @property
    def most_last(self) -> int:
        """The greatest number of ticks since a read."""
        return self.max_ticks

    @cached_property
    def gains(self) -> tuple[tuple[int, ...], ...]:
        """Also that by which the lag adds to the velocity: α − β/2 + γ/12, over X."""

        def of_lag(number: int) -> float:
            x = 2 ** (-2 - (number + 0.5) / GAIN_STEPS)
            return (9 - 27 * x + 20 * x * x) / ((1 + x) * (1 + 2 * x))

        return (*super().gains, tuple(fixed_log(math.log2(of_lag(number))) for number in range(GAINS)))

    @property
    def tables(self) -> tuple[int, ...]:
        return (*super().tables, *[0] * (5 * GAINS), *self._turned(3))

    @property
    def most_shown(self) -> int:
        return self.most_moved << self.velocity_out - self.shift

    @cached_property
    def constants(self) -> dict[str, int]:
        lsb, t = 1 << self.moved_shift, self.time_bits
        return super().constants | {
            "least_noise": round(lsb / 3),  # that of rounding alone
            "minus_change": -3 * lsb // 2,
            "log_many": fixed_log(5),
            "minus_mean": -2 * lsb,  # of twice a mean
            "least_far": -3 * lsb,
            "most_silent": self.max_ticks << t,
            "of_period": fixed_log(self.period_bits + 2 + self.moved_shift + self.shifts["place"]),
            "carried": (_CARRIED + 1) << t,
        }
