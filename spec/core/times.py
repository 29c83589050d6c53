"""Deadlines of a core: how far ticks and updates are apart, when it shows a rest, and the bits of these times."""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tick import Tick
from tachometry.spec.language.port import TICK
from tachometry.spec.language.units import signed_width


@dataclass(frozen=True)
class Times:
    """How far ticks and updates are apart, in clocks, and after how many ticks the shaft is known to rest.

    A method states what differs from most others.
    """

    asked: Asked
    tick: Tick
    latency: Latency
    min_tick_cycles: int  # fewest clocks between two external ticks
    longest: int  # clocks after which an update is forced, with ticks as long as nominal
    standstill_ticks: int  # ticks from that of the last count to the update that reads 0, at most
    interval_unit: int  # clocks in one unit of `interval`
    max_tick_shift: int = 0  # greatest k where a tick may last 2^k nominal ones
    spacing: int | None = None  # fewest clocks between two updates; None: one tick
    shortest: int | None = None  # clocks that every measurement lasts longer than; None: there is no such time

    @property
    def filter_lag(self) -> Fraction:
        """Seconds by which a low-pass filter is late on a ramp; 0 without one."""
        return Fraction(0) if self.asked.lowpass is None else 1 / self.asked.lowpass

    @property
    def shortest_tick(self) -> int:
        """Fewest clocks in a tick."""
        return self.min_tick_cycles if self.asked.external_tick else self.asked.timing.tick_cycles

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates."""
        return self.shortest_tick if self.spacing is None else self.spacing

    @property
    def standstill_after_ticks(self) -> int:
        """Nominal ticks without a count after which `standstill` rises: of empty ticks, or since the last count."""
        return self.asked.timing.max_ticks + (self.asked.facts.rests_with == TICK)


@dataclass(frozen=True)
class Widths:
    """Bits of the numbers of a core beside its velocity."""

    max_pulse_count: int  # largest |m_e| of the longest tick, less the time that own ticks may wait for a count
    interval: int  # bits of `interval`, unsigned
    stamp: int  # bits of the ticks that may fall between the cause of an update and the update; 0 without an age

    @property
    def count(self) -> int:
        """Bits of `pulse_count`."""
        return signed_width(self.max_pulse_count)
