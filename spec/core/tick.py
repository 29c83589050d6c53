"""The sampling period of a core, and one count in it."""

import math
from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.core.asked import Asked
from tachometry.spec.formats.velocity_output import NATIVE, per_count
from tachometry.spec.language.units import SpeedUnit


@dataclass(frozen=True)
class Tick:
    """The sampling period."""

    asked: Asked

    def seconds(self, clocks: int) -> Fraction:
        """Return a number of clocks in seconds, exactly."""
        return Fraction(clocks, self.asked.timing.clock_hz)

    @property
    def longest(self) -> int:
        """Most clocks in a tick."""
        return self.asked.longest_tick

    @property
    def room(self) -> int:
        """Clocks of work for which a tick is long enough; external ones may come in half the time."""
        return self.asked.timing.tick_cycles // (1 + self.asked.external_tick)

    @property
    def max_count(self) -> int:
        """Largest |m_e|: ⌈max_speed/ω_u⌉, for the longest tick, at most one count per clock, or half a turn if read."""
        fastest, sampled = self.asked.max_speed, self.asked.encoder.sampled
        most = sampled.most_moved if sampled else self.longest
        if fastest is None:
            return most
        return min(most, fastest.ceil_counts(self.asked.encoder.counts_per_rev, self.seconds(self.longest)))


@dataclass(frozen=True)
class Scale:
    """One count per tick, in other units."""

    asked: Asked

    @property
    def per_count(self) -> Fraction:
        """One count per tick in the unit."""
        return per_count(self.asked.unit, self.asked.encoder.counts_per_rev, self.asked.timing.tick_seconds)

    @property
    def unit_velocity(self) -> float:
        """ω_u = 2π/(P·T_s) in rad/s, one count per tick (Tsuji 2009, Sec. V-A)."""
        return 2 * math.pi / float(self.asked.encoder.counts_per_rev * self.asked.timing.tick_seconds)

    @property
    def own_unit(self) -> SpeedUnit:
        """The unit of the velocity; rad/s for counts per tick, which depend on the tick."""
        return SpeedUnit("rad/s" if self.asked.unit == NATIVE else self.asked.unit)

    @property
    def shown_unit(self) -> SpeedUnit:
        """The unit in which commands show speeds: that of the velocity, else the one that was typed, else rad/s."""
        asked = self.asked
        typed = asked.shown or (asked.max_speed and asked.max_speed.unit)
        return SpeedUnit(typed) if typed and asked.unit == NATIVE else self.own_unit
