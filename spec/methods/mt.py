"""The M/T method: counts over the time that they take, which is longer than a given one (Tsuji 2009, Sec. IV-C)."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from tachometry.spec.core.facts import Facts
from tachometry.spec.core.times import Times
from tachometry.spec.core.timing import parse_clocks
from tachometry.spec.core.words import Words
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.methods.timed import TimedForm, TimedTachometer


@dataclass(frozen=True)
class MTForm(TimedForm):
    """Numbers of timer and divider of the M/T method."""

    min_clocks: int  # T_c in clocks, as it is asked for; else a tick
    cycle_counts: int  # counts of which a window that has travelled as many holds a multiple; 1: any number

    @property
    def min_periods(self) -> int:
        """Timer periods that a measurement has to exceed: T_c, or one less than a division if that is longer."""
        return max(self.min_clocks // self.timer_cycles, self.division_periods - 1)

    @property
    def patient_periods(self) -> int:
        """Timer periods after which any count closes a window."""
        return self.min_periods * (2 if self.cycle_counts > 1 else 1)

    @property
    def max_interval(self) -> int:
        # A window stays open while the one before is divided, for ticks of two clocks at least.
        late = -(-self.division_clocks // 2) if self.may_be_late else 0
        return max(self.patient_periods, late) + self.max_periods

    @property
    def most_travelled(self) -> int:
        """Greatest distance of a window in counts, times the timer periods in a tick.

        Counts come only until one closes the window, which one does that is later than its least length: in each timer
        period up to that, and in the one in which it ends.
        """
        per_period = self.tick.max_count if self.on_lattice else self.timer_periods
        return (self.max_interval - self.max_periods + 1) * per_period + self.most_displaced

    @property
    def remembered_periods(self) -> int:
        # The open window, whose length may wrap, ends with a count; then comes the next window.
        return (1 << self.max_interval.bit_length()) + self.max_periods + self.max_interval + 2


_MIN_TIME = "Tc: a measurement lasts longer than this. In s, ms, us or ns, or clocks: 960clk."
_WHOLE_CYCLES = """Let measurements last whole cycles of A and B. Phase and duty errors of the encoder then cancel. \
Below one cycle per Tc, and at reversals, they end as without it."""


@dataclass(frozen=True, kw_only=True)
class MTTachometer(TimedTachometer):
    """Divides counts by the time from the first to the last of them (M/T method, eq. (13) of Tsuji 2009).

    A window opens at a count, and closes at the first count later than T_c after that. The closing count opens the next
    window. The velocity is in counts per tick, correctly rounded. A value out of range raises ParameterError.
    """

    min_time: int | None = option(
        None, _MIN_TIME, shown="a tick", metavar="TIME", unit="clocks", parse_at=parse_clocks, tests=("", "longest")
    )
    whole_cycles: bool = option(False, _WHOLE_CYCLES)

    method = "mt"
    facts = Facts(
        title="M/T",
        summary="takes the time of many counts",
        update_by="count",
        interval="timer periods",
        rest_tenths=22,
    )
    equation = 13
    one_count = False

    @cached_property
    def form(self) -> MTForm:
        min_clocks = self.timing.tick_cycles if self.min_time is None else self.min_time
        counts = self.encoder.decoding if self.whole_cycles else 1
        return MTForm(**vars(super().form), min_clocks=min_clocks, cycle_counts=counts)

    @property
    def wanted_room(self) -> int:
        return self.form.division_clocks

    @cached_property
    def times(self) -> Times:
        return replace(super().times, shortest=self.form.min_periods * self.form.timer_cycles)

    @cached_property
    def words(self) -> Words:
        words, shortest = super().words, self.form.min_periods * self.form.timer_cycles
        notes = self._raised("minimum time", self.form.min_clocks, shortest)
        return replace(words, notes=(*notes, *words.notes))

    def __post_init__(self) -> None:
        super().__post_init__()
        longest = self.timing.max_ticks * self.timing.tick_cycles
        if not 1 <= self.form.min_clocks <= longest:
            raise ParameterError(
                "min_time", f"must be from 1 to {longest} clocks, the maximum time, not {self.min_time}"
            )
        if self.form.min_clocks % self.form.timer_cycles:
            rest = f"must be a multiple of {self.form.timer_cycles} clocks with times in ticks, not {self.min_time}"
            raise ParameterError("min_time", rest)
        if self.whole_cycles and self.encoder.sensor == "hall":
            raise ParameterError("whole_cycles", "must not be given with --sensor hall: a period of halls has 6 counts")
        if self.whole_cycles and self.form.on_lattice:
            raise ParameterError(
                "whole_cycles", "must not be given with times in ticks, which are coarser than the errors that cancel"
            )
        if self.whole_cycles and self.paper_exact:
            raise ParameterError("whole_cycles", "must not be given with paper_exact, which has no such windows")

    @property
    def parameters(self) -> dict[str, Any]:
        return super().parameters | {"min_time": self.times.shortest}
