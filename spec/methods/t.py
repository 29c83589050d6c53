"""The T method: the time from one count to the next (Tsuji 2009, Sec. IV-B)."""

from dataclasses import dataclass

from tachometry.spec.methods.timed import TimedTachometer


@dataclass(frozen=True, kw_only=True)
class TTachometer(TimedTachometer):
    """T-method tachometer: one count over the time since the count before, eq. (9) of Tsuji 2009.

    The velocity is in counts per tick, correctly rounded. It is 0 for two consecutive counts of opposite sign, which
    are from the same edge of the encoder.
    """

    method = "t"
    summary = "takes the time between two counts"
    equation = 9

    @property
    def max_velocity(self) -> int:
        # On the lattice at most one count in a tick.
        return min(self.max_count, self.max_quotient)

    @property
    def max_interval(self) -> int:
        return self.max_periods

    @property
    def remembered_periods(self) -> int:
        # The time since the last count, which may wrap, and the time to the next one.
        return (1 << self.max_periods.bit_length()) + self.max_periods + 1

    @property
    def max_quotient(self) -> int:
        return self.timer_periods

    @property
    def flags_range(self) -> bool:
        return self.saturates or self.on_lattice
