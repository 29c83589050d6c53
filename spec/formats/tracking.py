"""Formats of the tracking recursion: how many bits its numbers have, and why these are enough.

p is in counts, relative to the position; v is in counts per U, where U is 2^k clocks, about 1/(4·λ_0). Both have F
fraction bits. a is in counts per U², and has F + S fraction bits. In this unit of time the three are of a similar size,
so one word fits all. Times are whole clocks. Products are rounded to the nearest.

Error analysis. A count comes every m ticks; d = 1 − θ, and u = U/T_s. The count adds d³·(u/m)²·e to a. The product
h = d²·(u/m)·e is rounded by at most 2^−F/2, which adds d·(u/m)/2·2^−F to a. The sum a is rounded by 2^−(F + S)/2. If
both go one way with each count, a keeps still only where a constant deviation e of p from the counts makes up for them:

    |e| ≤ 2^−F/2 · m/(d²·u) · (1 + m/(d·u·2^S))

S makes the second term as small as the first. This e gives the velocity 3·d/m·|e| in counts per tick; the roundings of
v add at most 2^−F·(1.5/(d·u) + 1). F is the least with which the sum is at most half an LSB of the velocity, and |e| at
most half one of the fine position. They are greatest for the least λ, and either for m = 1, for the longest silence, or
where x = λ·m·T_s has just reached its most.

The gain d is less than 1 and has B fraction bits. The gain d·U/m is less than 2^(1 + R) and has B − R; R is 0, except
where ticks may be much shorter than U. Their relative error is below 2^−(B − R)/d. It only moves the poles. B − R is
such that a transient of one count per tick is off by at most an eighth of an LSB for it.
"""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

from tachometry.spec.language.units import ceil_log2, signed_width

LEVELS = 16  # of λ, from λ_0 to λ_0/10, with equal ratios
RATIOS = tuple(10 ** (-level / (LEVELS - 1)) for level in range(LEVELS))
SHORTEST_MEMORY = 0.2  # of 1 − θ_min: it does not fall further as λ does
AGILE = 4  # times λ_0
STEP_BACK = 4  # levels, when the mean error is large
THRESHOLD_BITS = 16  # of the threshold of the mean error, that count
MOST_EXTRA_BITS = 9
LEAST_TICK_BITS = 8  # a tick has more than 2^8 clocks, as the program does
GROWTH = 10  # λ falls by its e-th part in so many of its time constants


@dataclass(frozen=True)
class Tracking:
    """Formats and constants of a tracking recursion.

    Parameters
    ----------
    clock_hz, tick_cycles, longest_tick, max_ticks, max_count : int
        Clock, nominal and longest tick in clocks, the longest silence in ticks, most counts of a tick.
    external : bool
        Whether ticks come from outside, and differ in length.
    bandwidth : Fraction, rad/s
        λ_0.
    least_memory : Fraction
        θ_min at λ_0.
    edge_error : Fraction, counts
        E.
    agile, growing : bool
        Whether a large error is corrected with four times the bandwidth.
        Whether λ falls to λ_0/10 while the errors are small.
    velocity_bits, fine_bits : int
        Fraction bits of the velocity in counts per tick, and of the position.
    """

    clock_hz: int
    tick_cycles: int
    longest_tick: int
    max_ticks: int
    max_count: int
    external: bool
    bandwidth: Fraction
    least_memory: Fraction
    edge_error: Fraction
    agile: bool
    growing: bool
    velocity_bits: int
    fine_bits: int

    @cached_property
    def unit_bits(self) -> int:
        """k: the unit of time U is 2^k clocks, at most 1/(4·λ_0), but at least half the longest tick."""
        fitting = -ceil_log2(AGILE * self.bandwidth / self.clock_hz)
        return max(fitting, self.longest_tick.bit_length() - 1)

    @cached_property
    def unit_ticks(self) -> Fraction:
        """u: U in nominal ticks."""
        return Fraction(1 << self.unit_bits, self.tick_cycles)

    def rate(self, level: int) -> float:
        """Return λ of a level, per clock."""
        return float(self.bandwidth) * RATIOS[level] / self.clock_hz

    def most(self, level: int) -> float:
        """Return the greatest x = λ·m·T_s that counts for the gains of a level: −ln θ_min."""
        return -math.log(1 - float(1 - self.least_memory) * max(RATIOS[level], SHORTEST_MEMORY))

    def _gains(self) -> list[tuple[int, float]]:
        """Return m and d where errors are greatest: a count in every tick, as seldom as may be, and where x reaches its
        most.

        In all of them λ is the least.
        """
        level = LEVELS - 1 if self.growing else 0
        each = self.rate(level) * self.tick_cycles
        ticks = {1, self.max_ticks, max(1, min(round(self.most(level) / each), self.max_ticks))}
        return [(m, 1 - math.exp(-min(each * m, self.most(level)))) for m in sorted(ticks)]

    @cached_property
    def extra_bits(self) -> int:
        """S, by the error analysis above."""
        most = max(m / (d * float(self.unit_ticks)) for m, d in self._gains())
        return min(max(math.ceil(math.log2(most)), 0), MOST_EXTRA_BITS)

    @cached_property
    def frac_bits(self) -> int:
        """F, by the error analysis above."""
        u = float(self.unit_ticks)
        finest = 0
        for m, d in self._gains():
            error = m / (d * d * u) / 2 * (1 + m / (d * u) / 2**self.extra_bits)  # of p, in 2^−F
            velocity = 3 * d / m * error + 1.5 / (d * u) + 1
            bits = (self.velocity_bits + math.log2(velocity), self.fine_bits + math.log2(error + 1))
            finest = max(finest, *(1 + math.ceil(each) for each in bits))
        return finest

    @cached_property
    def acceleration_error(self) -> float:
        """Error of a, in its LSB."""
        u = float(self.unit_ticks)
        return max((4.5 * u / m) * 2**self.extra_bits + 1.5 / d for m, d in self._gains())

    @cached_property
    def ratio_range(self) -> int:
        """R, of the range of the gain d·U/m."""
        shortest = 1 << LEAST_TICK_BITS if self.external else self.tick_cycles
        x = min((AGILE if self.agile else 1) * self.rate(0) * shortest, self.most(0))
        greatest = (1 - math.exp(-x)) * (1 << self.unit_bits) / shortest
        return max(math.floor(math.log2(greatest * (1 + 2.0**-10))), 0)

    @cached_property
    def gain_bits(self) -> int:
        """B: fraction bits of the multipliers."""
        d = self._gains()[0][1]
        least = self.velocity_bits + 3 + math.ceil(-math.log2(min(d, d * float(self.unit_ticks))))
        return max(20, least) + self.ratio_range

    @cached_property
    def max_velocity(self) -> int:
        """Greatest |v|, in 2^−F counts per U: `max_count` counts in a tick as long as nominal."""
        return (self.max_count << (self.frac_bits + self.unit_bits)) // self.tick_cycles

    @cached_property
    def max_acceleration(self) -> int:
        """Greatest |a|, in 2^−(F + S) counts per U²: an eighth of the greatest speed within U."""
        return (self.max_velocity << self.extra_bits) >> 3

    @cached_property
    def max_error(self) -> int:
        """|e| from which the recursion starts anew, in counts: no shaft within the greatest speed has it."""
        return 2 * self.max_count + 2

    @cached_property
    def max_gap(self) -> int:
        """Most clocks from a tick with counts to the end of the next one, and what the first count was early."""
        return (self.max_ticks + 1) * self.longest_tick

    @cached_property
    def gap_bits(self) -> int:
        """Bits of a number of clocks between counts."""
        return self.max_gap.bit_length()

    @cached_property
    def times_bits(self) -> int:
        """Bits of the sum of the times from the counts of a tick to its end, in clocks."""
        return max((self.max_count * (self.longest_tick - 1)).bit_length(), 1)

    @cached_property
    def number_bits(self) -> int:
        """Bits of the number of counts of a tick."""
        return self.max_count.bit_length()

    @cached_property
    def places_bits(self) -> int:
        """Bits of the sum of twice the places of a tick's counts, relative to its end; signed."""
        return signed_width(self.max_count * (2 * self.max_count - 1))

    @cached_property
    def _moved(self) -> float:
        """Counts that v says for a tick, at most: more than a may add to it."""
        return 2 * max(self.max_count, self.max_velocity * self.longest_tick / 2 ** (self.unit_bits + self.frac_bits))

    @cached_property
    def mean_bits(self) -> int:
        """Bits of a mean over the counts of a tick."""
        return math.ceil(math.log2(self.max_count + self._moved)) + self.frac_bits

    @cached_property
    def gap_shift(self) -> int:
        """Left shift of a gap after which it is greater than d: no tick is as short as this allows."""
        return self.gain_bits - LEAST_TICK_BITS

    @cached_property
    def least_gap(self) -> int:
        """Fewest clocks between the first two counts."""
        return max(self.tick_cycles // self.max_count, 1)

    @cached_property
    def start_bits(self) -> int:
        """Bits that the first velocity is computed coarser by, so that it cannot leave the word."""
        # Before it is held within the greatest velocity: the counts of a tick and one more in the shortest time.
        bits = ceil_log2(Fraction((self.max_count + 2) << self.unit_bits, self.least_gap)) + self.frac_bits + 1
        return min(max(bits - self.width, 0), self.unit_bits)

    @cached_property
    def width(self) -> int:
        """W: bits of a word."""
        # The greatest d²·U/gap and d³·(U/gap)², which are those of the greatest x.
        rate = (AGILE if self.agile else 1) * self.rate(0) * (1 << self.unit_bits)
        d = 1 - math.exp(-self.most(0))
        of_v, of_a = rate * d**2 / self.most(0), rate**2 * d**3 / self.most(0) ** 2
        greatest = max(
            # v before it is held within its limit; a adds a quarter, as no tick is longer than 2·U.
            self.max_velocity / 2**self.frac_bits * 1.25 + 3 * self.max_error * of_v,
            # What is multiplied: on its way to a product the adder holds nearly twice as much. The rest of it is less
            # than another term: v·Στ, as the sum over the counts of a tick, is less than the dividend of their mean;
            # and e·d is less than h, or, where R < 2, than 4·e.
            2 * self.max_error * of_v * 2 ** (self.extra_bits + self.ratio_range),  # h
            2 * self.max_acceleration / 2**self.frac_bits,
            2.25 * self.max_velocity / 2**self.frac_bits,
            4 * self.max_error,  # e less its mean
            self.max_acceleration / 2**self.frac_bits + self.max_error * of_a * 2**self.extra_bits,
            2 * self.max_error + 2 * self._moved + 2,  # p
            AGILE * self.rate(0) * (1 << self.gap_bits),  # x
        )
        whole = math.ceil(math.log2(greatest))
        dividend = max(self.number_bits + self.mean_bits, self.gap_bits + self.gap_shift)
        return max(whole + self.frac_bits, dividend) + 1

    def fixed(self, value: float | Fraction) -> int:
        """Return a number with F fraction bits."""
        return round(value * (1 << self.frac_bits))

    def rate_word(self, rate: float) -> int:
        """Return what a gap in clocks is multiplied by, and the product shifted right by gap_bits − 1, for x =
        rate·gap.
        """
        return round(rate * 2.0 ** (self.frac_bits + self.gap_bits - 1))

    @cached_property
    def rates(self) -> tuple[int, ...]:
        """The rates of each level."""
        return tuple(self.rate_word(self.rate(level)) for level in range(LEVELS))

    @cached_property
    def agile_rate(self) -> int:
        """The rate of an agile correction."""
        return self.rate_word(AGILE * self.rate(0))

    @cached_property
    def most_x(self) -> tuple[int, ...]:
        """Greatest x of each level."""
        return tuple(self.fixed(self.most(level)) for level in range(LEVELS))

    @cached_property
    def spans(self) -> tuple[int, ...]:
        """Clocks without trouble after which each level gives way to the next."""
        edges = [0.0]
        for upper, lower in pairwise(RATIOS):
            edges.append(GROWTH * (1 / math.sqrt(upper * lower) - 1) / float(self.bandwidth))
        spans = [round((end - begin) * self.clock_hz) for begin, end in pairwise(edges)]
        longest = (1 << (self.width - 1)) - 1 - self.max_gap
        return (*(min(span, longest) for span in spans), longest)

    @cached_property
    def late_limit(self) -> int:
        """How far p may go from the position while no count comes: ½ + 1.5·E."""
        return self.fixed(Fraction(1, 2) + Fraction(3, 2) * self.edge_error)

    @cached_property
    def mean_threshold_bits(self) -> int:
        """Fraction bits of the threshold of the mean error."""
        return THRESHOLD_BITS - math.floor(2 * math.log2(self.edge_error / 4))

    @cached_property
    def mean_threshold(self) -> int:
        """(0.25·E)²: the square of the mean error over the share of the last error in it, that is trouble."""
        return round((self.edge_error / 4) ** 2 * (1 << self.mean_threshold_bits))
