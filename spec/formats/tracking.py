"""Formats of the tracking recursion: how fine its numbers are, and why that is enough.

A word has 40 bits. Places are in 2^−20 counts, relative to the position at the end of the tick. Times are in clocks
with `time_bits` fraction bits, so that no time of a tick is longer than a factor of the multiplier. Logarithms are to
base 2, with 12 fraction bits. The velocity is in 2^−`velocity_bits` counts per clock: 8 times the greatest speed fits.
The acceleration is in 2^−`acceleration_bits` counts per clock²: `greatest_acceleration` fits, and more is held there.

Error analysis. What is added to p, v and a is a power of 2 from a table, off by at most 0.2 % and at most an LSB; the
relative error moves the gains only, which are flat. A result is rounded up if its 8 bits below the LSB and the number
of the event, its bits reversed, carry: so in the mean of 256 events nothing is lost, and a step below the LSB is still
made. What is left is a walk of a by less than an LSB an event, over as many events as the memory has: 2^−63 ·
(48 MHz)² · √8192 = 0.023 counts/s² at 2000 counts, which is 1/70 of what a real disc leaves. A finer disc leaves less
of that, so less than 100,000 rad/s² has to fit there. Products by a time are exact to the LSB, as the time is.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

from tachometry.spec.formats.displacement import Displacement
from tachometry.spec.language.units import ceil_log2

WIDTH = 40  # bits of a word
PLACE_BITS = 20  # fraction bits of a place
LOG_BITS = 12  # fraction bits of a logarithm
CHANCE_BITS = 8  # bits below the LSB that decide which way a result is rounded
RESULT_BITS = WIDTH - 4  # a product or a power is held below 2^36, so that sums of some fit the word
DROPPED = 5  # no product is shifted by less
LOG_INDEX, EXP_INDEX = 7, 8  # bits of the index of the tables of log2 and of 2^x
TABLE_BITS = 18  # of what is read from a table, as a block RAM has: a logarithm in it is less than 64
GAIN_STEPS, GAIN_OCTAVES = 16, 8  # entries of a table of gains: an octave has 16
GAINS = GAIN_STEPS * GAIN_OCTAVES
GAINS_FROM = 2 * GAIN_STEPS  # they begin at X = 1/4
POWER_BITS = 17  # fraction bits of a power in its table
MOST_NUMBER_BITS = 11  # of the counts of a tick that an event takes

MOST_MEMORY = 4  # seconds
MOST_EVENTS_BITS = 13  # memory does not grow beyond 2^13 events
# The deviation of a slope at the end of N events in the time T, as D·√(1/N)/T: of a line and of a parabola.
STRAIGHT, CURVE = 2.3, 12.0
FORGET = Fraction(1, 10)  # seconds of silence after which the state is forgotten, if the maximum time is no longer


def fixed_log(value: float) -> int:
    """Return a logarithm as a word."""
    return round(value * (1 << LOG_BITS))


def greatest_acceleration(counts_per_rev: Fraction | int) -> float:
    """Return the greatest acceleration of the word, in rad/s²: less if counts are finer, for the sake of the LSB."""
    return 110_000 / math.sqrt(max(counts_per_rev / 2000, 1))


@dataclass(frozen=True)
class Tracking:
    """Formats and constants of a tracking recursion."""

    # clock_hz, tick_cycles and longest_tick: clock, nominal and longest tick in clocks
    clock_hz: int
    tick_cycles: int
    longest_tick: int
    external: bool  # whether ticks come from outside, and differ in length
    max_count: int  # most counts of a tick
    counts_per_rev: Fraction | int
    max_memory: Fraction | None  # seconds: what memory does not grow beyond; None: 4 s
    max_time: int  # clocks of silence after which 0 is shown
    velocity_out: int  # fraction bits of the velocity in counts per tick that is shown
    slope: Fraction  # LSB of the acceleration that is shown in one of the recursion, less than 1
    velocity_std: Fraction  # LSB of the deviation that is shown, in one count per clock
    std_bits: int  # of it
    displacement: Displacement | None = None  # of edges off their places

    sampled: ClassVar[bool] = False  # whether positions are read in place of counted edges
    kind_bits: ClassVar[int] = 2  # of the kind of an edge, or of the eighth of a period
    period_bits: int = 0  # bits of a period whose error is learned, in LSB of the read; 0: none is
    exchanges: bool = False  # whether a program reads and writes the offsets of the period
    waits: bool = False  # whether a read that is far waits for the next one, as nothing checks its frame

    @cached_property
    def factor_bits(self) -> int:
        """Bits of the second factor of a product: all those of a tick."""
        return max(16, self.longest_tick.bit_length())

    @cached_property
    def time_bits(self) -> int:
        """Fraction bits of a time."""
        return min(2, self.factor_bits - self.longest_tick.bit_length())

    @cached_property
    def number_bits(self) -> int:
        """Bits of the number of counts of an event: further counts of a tick move the position alone."""
        return min(self.max_count.bit_length(), MOST_NUMBER_BITS)

    @property
    def most_number(self) -> int:
        """Most counts of an event."""
        return (1 << self.number_bits) - 1

    @property
    def moved_shift(self) -> int:
        """Fraction bits of the way of a tick in the unit of its input, as a place."""
        return PLACE_BITS

    @property
    def most_last(self) -> int:
        """The greatest time from the last count of a tick to its end, in clocks."""
        return self.longest_tick - 1

    @property
    def times_bits(self) -> int:
        """Bits of the sum of the clocks from each of these to the end of the tick."""
        return max((self.most_number * (self.longest_tick - 1)).bit_length(), 1)

    @property
    def places_bits(self) -> int:
        """Bits of the sum of twice their places; signed."""
        return (self.most_number**2).bit_length() + 1

    @property
    def fine_bits(self) -> int:
        """Bits of the places of counts below half a count, which displacements have."""
        return 0 if self.displacement is None else self.displacement.per_count.bit_length() - 2

    @property
    def placed_bits(self) -> int:
        """Bits of the sum of twice the places, with displacements and as fine as these, or of 64 times one; signed."""
        off = self.displacement
        return self.places_bits if off is None else max(self.places_bits, 7) + max(self.fine_bits, off.width - 1) + 1

    @cached_property
    def moved_bits(self) -> int:
        """Bits of the way of a tick in counts; signed."""
        return self.longest_tick.bit_length() + 1

    @cached_property
    def velocity_bits(self) -> int:
        """Fraction bits of the velocity."""
        return WIDTH - 2 - 3 - ceil_log2(Fraction(self.max_count, self.longest_tick))

    @cached_property
    def acceleration_bits(self) -> int:
        """Fraction bits of the acceleration."""
        greatest = min(
            greatest_acceleration(self.counts_per_rev) * self.counts_per_rev / (2 * math.pi) / self.clock_hz**2,
            8 * self.max_count / self.longest_tick**2,  # within a tick to what the velocity's word holds
        )
        in_table = (1 << TABLE_BITS - LOG_BITS) - 6 + PLACE_BITS - 2 * self.time_bits  # the greatest gain: 60 < 2^6
        return min(WIDTH - 2 - math.ceil(math.log2(greatest)), in_table)

    @cached_property
    def shifts(self) -> dict[str, int]:
        """The right shift of each product, by its name in the listing."""
        v, a, t = self.velocity_bits, self.acceleration_bits, self.time_bits
        return {
            "half_velocity": a - v + t + 1,  # a·t/2
            "velocity": a - v + t,  # a·t
            "place": v - PLACE_BITS + t,  # v·t
            "place_64": v - PLACE_BITS + t + 6,  # v·t/64
            "time": 0,
            "mean": 6,
            "shown": v - self.velocity_out,
            "acceleration": self.factor_bits - ceil_log2(self.slope),
        }

    @cached_property
    def most_since(self) -> int:
        """Longest time from an event on that is told from longer ones: a product by it needs no left shift."""
        bits = min(self.shifts["velocity"], self.shifts["place"]) + DROPPED + 6
        return (1 << min(bits, WIDTH - 2)) - 1

    @property
    def memory_seconds(self) -> Fraction:
        """Seconds, beyond which memory does not grow."""
        return Fraction(MOST_MEMORY) if self.max_memory is None else self.max_memory

    @property
    def most_shown(self) -> int:
        """The greatest velocity that is shown."""
        return self.max_count << self.velocity_out

    @cached_property
    def constants(self) -> dict[str, int]:
        """Constants of the listing, ahead aside."""
        one, t = 1 << PLACE_BITS, self.time_bits
        v, a = self.velocity_bits, self.acceleration_bits
        order = fixed_log(12 - 2 * PLACE_BITS + 2 * a + 4 * t)
        forget = max(math.ceil(FORGET * self.clock_hz), self.max_time)
        most = (1 << (WIDTH - 2)) - 16
        noises = 1 << (self.factor_bits - CHANCE_BITS - 1)  # one event among those that the noise is learned from
        of_std = math.log2(self.velocity_std) - a - t - 6 - 3 / 2  # over the roots of the order and of log_8
        logs = {
            "of_straight": math.log2(STRAIGHT) + of_std, "of_curve": math.log2(CURVE) + of_std, "none": -127,
            "log_3_2": math.log2(3 / 2), "log_9_4": math.log2(9 / 4), "log_8": 3, "log_many": 5.5, "log_64": 6,
            "log_256": 8, "log_8192": MOST_EVENTS_BITS, "log_4": 2, "log_eighth": -3, "log_half": -1,
            "log_5_8": math.log2(8 / 5),
            "of_velocity": v - PLACE_BITS + t, "of_speed": v + t, "of_slope": a - v + t + 1,
            "of_bound": math.log2(self.velocity_std) - v + 2**-EXP_INDEX,  # not below the velocity for the table
        }  # fmt: skip
        return {
            **{name: fixed_log(value) for name, value in logs.items()},
            "past_4": fixed_log(2) + 1, "log_quarter": -fixed_log(2) - 1,
            "past_8": fixed_log(3) + 32,  # a memory of 8 events is off by so much, for the tables
            "order": order, "order_lag": order - fixed_log(math.log2(3.5)),
            "zero": 0, "one": 1, "three": 3, "minus_one": -1, "minus_two": -2, "fade": -5,
            "count": one, "half": one // 2,
            "quarter": one // 4, "minus_quarter": -one // 4,
            "sixteenth": one // 16, "minus_sixteenth": -one // 16,
            "least_noise": one >> 10, "most_noise": 1 << RESULT_BITS - 2,  # which no error reaches
            "slope": round(self.slope * (1 << self.shifts["acceleration"])),
            "clock": 1 << t, "tick": self.tick_cycles,
            "most_since": self.most_since, "most_memory": min(int(self.memory_seconds * self.clock_hz) << t, most),
            "max_time": self.max_time << t, "forget": forget << t,
            "most_std": (1 << self.std_bits) - 1,
            "most": most, "most_shown": (shown := self.most_shown), "least_shown": -shown, "all_shown": 2 * shown,
            "noises_one": noises, "noises_first": 8 * noises, "noises_least": 16 * noises,
            "noises_offset": 256 * noises, "noises_most": 512 * noises,
        }  # fmt: skip

    @cached_property
    def gains(self) -> tuple[tuple[int, ...], ...]:
        """Logarithms of the gains of p, v and a over X, X² and X³ of an event, from X = 1/4 on downward."""
        v = self.velocity_bits - PLACE_BITS + self.time_bits
        a = self.acceleration_bits - PLACE_BITS + 2 * self.time_bits

        def all_of(number: int) -> tuple[float, float, float]:
            x = 2 ** (-2 - (number + 0.5) / GAIN_STEPS)
            rest = (1 + x) * (1 + 2 * x)
            return 9 * (1 - x + 2 / 3 * x * x) / rest, 36 * (1 - x / 2) / rest * 2**v, 60 / rest * 2**a

        found = zip(*map(all_of, range(GAINS)), strict=True)
        return tuple(tuple(fixed_log(math.log2(gain)) for gain in gains) for gains in found)

    @property
    def tables(self) -> tuple[int, ...]:
        """The tables of the unit: powers, gains, logarithms; those again, each twice.

        The serial unit has the leading one at a bit or one above. So in both cases all bits are an address.
        """
        gains = (gain for number in range(3) for gain in self._turned(number))
        return (*POWERS, *gains, *LOGS, *(log for log in LOGS for _ in range(2)))

    def _turned(self, number: int) -> tuple[int, ...]:
        """Return a table of gains whose index is one of log2."""
        gains = self.gains[number]
        return (*gains[-GAINS_FROM:], *gains[:-GAINS_FROM])


# Of 1 + (i + ½)/128, and of 2^((i + ½)/256).
LOGS = tuple(fixed_log(math.log2(1 + (i + 0.5) / 2**LOG_INDEX)) for i in range(2**LOG_INDEX))
POWERS = tuple(round(2 ** (POWER_BITS + (i + 0.5) / 2**EXP_INDEX)) for i in range(2**EXP_INDEX))
