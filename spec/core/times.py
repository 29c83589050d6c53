"""Times of a core: how far its ticks and its updates are apart, and when it shows that the shaft rests."""

from fractions import Fraction

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.core.probe import TIME_WIDTH
from tachometry.spec.core.timing import MAX_TICK_CYCLES
from tachometry.spec.language.port import TICK


class Times(Follows[S]):
    """Says how far ticks and updates are apart, in clocks, and after how many ticks the shaft is known to rest."""

    def seconds(self, clocks: int) -> Fraction:
        """Return a number of clocks in seconds, exactly."""
        return Fraction(clocks, self.spec.timing.clock_hz)

    @property
    def filter_lag(self) -> Fraction:
        """Seconds by which a low-pass filter is late on a ramp; 0 without one."""
        return Fraction(0) if self.spec.lowpass is None else 1 / self.spec.lowpass

    @property
    def longest_tick(self) -> int:
        """Most clocks in a tick; an external one lasts two nominal ones at most, if nothing else was asked for."""
        cycles = self.spec.timing.tick_cycles
        if not self.spec.external_tick:
            return cycles
        asked = self.spec.max_tick_cycles
        return min(2 * cycles, MAX_TICK_CYCLES) if asked is None else asked

    @property
    def shortest_tick(self) -> int:
        """Fewest clocks in a tick."""
        return self.min_tick_cycles if self.spec.external_tick else self.spec.timing.tick_cycles

    @property
    def min_tick_cycles(self) -> int:
        """Fewest clocks between two external ticks: all work that is done step by step must be finished."""
        latency = self.spec.latency
        output = latency.output if latency.output_serial else 0
        return max(2, latency.busy if latency.serial else 0, output)

    def has_room(self, clocks: int) -> bool:
        """Tell whether a tick is long enough for work of so many clocks; external ones may come in half the time."""
        return self.spec.timing.tick_cycles >= clocks * (1 + self.spec.external_tick)

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates."""
        return self.shortest_tick

    @property
    def max_tick_shift(self) -> int:
        """Greatest k where a tick may last 2^k nominal ones."""
        return 0

    @property
    def interval_unit(self) -> int:
        """Clocks in one unit of `interval`."""
        return self.spec.timing.tick_cycles

    @property
    def shortest(self) -> int | None:
        """Clocks that every measurement lasts longer than; None: there is no such time."""
        return None

    @property
    def longest(self) -> int:
        """Clocks after which an update is forced, with ticks as long as nominal."""
        return self.spec.timing.max_ticks * self.spec.timing.tick_cycles

    @property
    def probe_width(self) -> int:
        """Bits of the time from a count to a probe."""
        return min(self.longest.bit_length(), TIME_WIDTH)

    @property
    def probe_age_width(self) -> int:
        """Bits of the time from the end of a period whose update is shown to a probe."""
        return (self.longest_tick + self.spec.latency.tick_to_velocity + 2).bit_length()

    @property
    def standstill_ticks(self) -> int:
        """Ticks from that of the last count to the update that reads 0, at most."""
        return self.spec.timing.max_ticks

    @property
    def stalled_after_ticks(self) -> int:
        """Nominal ticks without a count after which `stalled` rises: of empty ticks, or since the last count."""
        return self.spec.timing.max_ticks + (self.spec.facts.stalls_with == TICK)
