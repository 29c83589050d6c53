"""The T method: the time from one count to the next (Tsuji 2009, Sec. IV-B)."""

from dataclasses import dataclass
from functools import cached_property

from tachometry.spec.core.facts import Facts
from tachometry.spec.methods.timed import TimedForm, TimedTachometer, TimedWidths


class TForm(TimedForm["TTachometer"]):
    """Finds the numbers of timer and divider of the T method."""

    equation = 9

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


class TWidths(TimedWidths["TTachometer"]):
    """Counts the bits of the numbers of a T-method core."""

    @property
    def max_velocity(self) -> int:
        # On the lattice at most one count in a tick.
        return min(self.max_count, self.spec.form.max_quotient)


@dataclass(frozen=True, kw_only=True)
class TTachometer(TimedTachometer):
    """Divides one count by the time since the count before (T method, eq. (9) of Tsuji 2009).

    The velocity is in counts per tick, correctly rounded. It is 0 for two consecutive counts of opposite sign, which
    are from the same edge of the encoder.
    """

    method = "t"
    facts = Facts(title="T", summary="takes the time between two counts", update_by="count", rest_tenths=22)
    form = cached_property(TForm)
    widths = cached_property(TWidths)
