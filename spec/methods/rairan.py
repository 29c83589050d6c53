"""The method of Rairán 2013: counts and sampling periods, both begun by a count."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.tick import Tick
from tachometry.spec.core.times import Times, Widths
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.core.words import Words
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.port import UPDATE, Port, held
from tachometry.spec.language.units import rounded
from tachometry.spec.methods.adaptive import AdaptiveDt, parse_target

# The estimates are looked up by Ndt1, or by Nep1 − 1, in a table with as many entries at most.
MAX_TABLE = 2048
ESTIMATES = ("n1", "n2", "n3")


@dataclass(frozen=True)
class RairanForm:
    """Tables of Rairán's estimates and of their bounds."""

    asked: Asked
    tick: Tick
    velocity: Velocity
    estimate: str
    adaptive: Fraction | None

    @property
    def max_tick_shift(self) -> int:
        """K: the greatest k for which a tick, of two dt at most, ends within the maximum time and fits the tables."""
        if self.adaptive is None:
            return 0
        longest = (self.asked.timing.max_ticks // 2).bit_length() - 1
        if self.estimate == "n3" or self.asked.bounds:
            longest = min(longest, (MAX_TABLE // self.tick.max_count).bit_length() - 1)
        # Nep1 or Nep1 − 1 of 2^k dt is not rounded.
        return longest if self.estimate == "n3" else min(longest, self.velocity.native_frac_bits)

    @property
    def max_pulse_count(self) -> int:
        """Largest |m_e| of the longest tick, less the time that it may wait for a count."""
        return self.tick.max_count << self.max_tick_shift

    @property
    def adaptive_dt(self) -> AdaptiveDt:
        """The rule of dt, for a core that has an adaptive dt."""
        assert self.adaptive is not None
        return AdaptiveDt(self.adaptive, self.max_tick_shift)

    def max_dt(self, shift: int) -> int:
        """Return greatest Ndt1 for dt·2^shift: how many of these the maximum time has."""
        return self.asked.timing.max_ticks >> shift

    @property
    def depth(self) -> int:
        """Entries of the table, a power of two: by Ndt1 and, for n3, by Nep1 − 1."""
        counts = self.max_pulse_count - 1 if self.estimate == "n3" else 0
        return 1 << max(self.asked.timing.max_ticks, counts).bit_length()

    @property
    def table(self) -> tuple[int, ...]:
        """Contents by address i; 0 at address 0 stands for the velocity 0.

        n1, n2: ⌊2^f/d + ½⌋ with d = i and i + 1. n3: ⌊2^(f+2)/q⌋ with q = 2i + 1. q is odd, so no multiple of ½ is
        among what is rounded, and with h the entry ⌊2^f·2/q + ½⌋ is ⌊(h + 1)/2⌋ (low) and ⌊2^f/(2q) + ½⌋ is
        ⌊(h + 4)/8⌋ (high). If dt is adaptive, n1 and n2 have one more bit, ⌊2^(f+1)/d⌋, as they are rounded later.
        """
        f = self.velocity.native_frac_bits
        if self.estimate == "n3":
            return (0, *((1 << (f + 2)) // (2 * i + 1) for i in range(1, self.depth)))
        more = self.estimate == "n2"
        if self.adaptive is not None:
            return (0, *((1 << (f + 1)) // (i + more) for i in range(1, self.depth)))
        return (0, *(((1 << (f + 1)) // (i + more) + 1) // 2 for i in range(1, self.depth)))

    @property
    def table_width(self) -> int:
        """Bits of an entry."""
        return max(self.table).bit_length()

    def _bound(self, counts: Fraction, periods: int, shift: int, more: int, towards: int) -> int:
        """Bound for so many counts in so many dt·2^shift, `more` clocks longer; outward, and clipped."""
        clocks = (periods * self.asked.timing.tick_cycles << shift) + more
        if clocks <= 0:
            return self.velocity.absent_bound
        exact = counts * self.asked.timing.tick_cycles * (1 << self.velocity.native_frac_bits) / clocks
        return min(math.floor(exact) if towards < 0 else math.ceil(exact), self.velocity.absent_bound)

    def _by_address(self, one: Callable[[int, int, bool], int]) -> tuple[int, ...]:
        """Return the table of a bound; `one` gives the entry for n, k and the regime.

        An entry's address is twice that of the estimate, plus one if it is high. Where dt is adaptive, a leading one
        tells the k of the address: for a low estimate k places below that of `low_depth`, for a high one k places above
        that of `high_depth`. n is always less than this leading one.
        """
        if self.adaptive is None:
            return tuple(one(n, 0, high) for n in range(self.bound_depth) for high in (False, True))
        entries = [0] * (2 * self.bound_depth)
        for shift in range(self.max_tick_shift + 1):
            low, high = self.low_depth >> shift, self.high_depth << shift
            entries[2 * low : 4 * low : 2] = [one(n, shift, False) for n in range(low)]
            entries[2 * high + 1 : 4 * high + 1 : 2] = [one(n, shift, True) for n in range(high)]
        return tuple(entries)

    @property
    def lower_table(self) -> tuple[int, ...]:
        """Lower bounds: n2 for a dt, or for Ndt1 + 1 of them, that took a clock longer; 0 for the estimate 0.

        With an edge error, there are as many again, for what implies no least speed: their negatives.
        """

        def lower(n: int, shift: int, high: bool) -> int:
            counts = max(Fraction(n if high else 1) - self.velocity.bound.edge_error, Fraction(0))
            return self._bound(counts, 1 if high else n + 1, shift, 1, -1) if n or high else 0

        def loose(n: int, shift: int, high: bool) -> int:
            return self._bound(self.velocity.bound.edge_error, n, shift, -1, 1) if n and not high else 0

        return self._by_address(lower) + (self._by_address(loose) if self.velocity.bound.edge_error else ())

    @property
    def upper_table(self) -> tuple[int, ...]:
        """Upper bounds: n1 for a dt, or for Ndt1 of them, that took a clock less; absent for the estimate 0."""

        def upper(n: int, shift: int, high: bool) -> int:
            counts = (n if high else 0) + self.velocity.bound.uncertainty
            return self._bound(counts, 1 if high else n, shift, -1, 1) if n or high else self.velocity.absent_bound

        return self._by_address(upper)

    @property
    def low_depth(self) -> int:
        """A power of two above every Ndt1."""
        return 1 << self.asked.timing.max_ticks.bit_length()

    @property
    def high_depth(self) -> int:
        """A power of two above every Nep1 − 1 of a dt as long as nominal."""
        return 1 << (self.tick.max_count - 1).bit_length()

    @property
    def bound_depth(self) -> int:
        """Entries of each bound's table for low speeds, and for high ones: by Ndt1 and by Nep1 − 1."""
        if self.adaptive is None:
            return max(self.low_depth, self.high_depth)
        return 2 * max(self.low_depth, self.high_depth << self.max_tick_shift)

    def tie(self, shift: int) -> int | None:
        """Return the Ndt1 for which n1 or n2 is just half an LSB, if there is one: it rounds up, to 1 or to −0."""
        ndt1 = (2 << self.velocity.native_frac_bits >> shift) - (self.estimate == "n2")
        return ndt1 if self.estimate != "n3" and ndt1 <= self.max_dt(shift) else None


_ESTIMATE = "Estimate that the velocity is, eq. (11). n1 is the upper bound, n2 the lower, n3 their harmonic mean."
_ADAPTIVE = """Longer dt, 2^k ticks, for an error of at most TARGET. It is the shortest with which the relative error \
of n3, eq. (13), is at most TARGET, such as 1% or 0.01."""


@dataclass(frozen=True, kw_only=True)
class RairanTachometer(TachometerSpec):
    """Tachometer of Rairán 2013: sampling periods dt that a count begins; the paper's ts is a clock.

    A window begins with a count. It lasts dt, which has Nep1 counts (high speeds, n1 = Nep1), or until the next count,
    Ndt1 whole dt later (low speeds, n1 = 1/Ndt1). Velocity is n1, n2 or n3 in counts per tick, dt being the tick,
    correctly rounded. What it does at reversals and at rest is in docs/concepts/rairan.md. A value out of range raises
    ParameterError.
    """

    estimate: str = option("n3", _ESTIMATE, choices=ESTIMATES)
    paper_exact: bool = option(False, "The published algorithm alone: no direction, no standstill.")
    bound_decay: bool = option(True, "Let the velocity decay while no count comes.")
    adaptive: Fraction | None = option(  # noqa: RUF009
        None, _ADAPTIVE, metavar="TARGET", parse=parse_target, tests=("", "25%")
    )

    method = "rairan"
    facts = Facts(
        title="Rairán's",
        summary="begins its ticks with a count (Rairán 2013)",
        update_by="count",
        interval="Ndt1 in sampling periods dt",
        own_ticks=True,
        last_at_rest=True,
    )

    @cached_property
    def form(self) -> RairanForm:
        """Tables of the estimates and of their bounds."""
        return RairanForm(self, self.tick, self.velocity, self.estimate, self.adaptive)

    @cached_property
    def latency(self) -> Latency:
        # Where it can, a step waits in a register before it decides what a window is. From the end of dt or a count: a
        # clock for the decision, one for the address, one for the table, one for the sum; `tick` takes two of these.
        registered = self.timing.tick_cycles > 1
        return Latency(self, self.velocity, 1, datapath=2, counting=2 + registered, registers_steps=registered)

    @cached_property
    def times(self) -> Times:
        # A count may come at any time.
        return replace(super().times, max_tick_shift=self.form.max_tick_shift, spacing=1)

    @cached_property
    def widths(self) -> Widths:
        return replace(super().widths, max_pulse_count=self.form.max_pulse_count)

    @property
    def remembered(self) -> int | None:
        if self.paper_exact:  # Table 1 to the letter recovers only with counts
            return None
        # Cdt may wrap before a count comes. The window up to the next count follows, and the one that this count opens.
        dt = (1 << self.widths.interval) + 2 * self.timing.max_ticks + 3
        return dt * self.timing.tick_cycles << self.form.max_tick_shift

    @cached_property
    def words(self) -> Words:
        memory = "table", self.form.depth, self.form.table_width
        return replace(super().words, description=f"Rairan 2013, {self.estimate}", memory=memory)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bounds and self.paper_exact:
            raise ParameterError("bounds", "must not be given with paper_exact, whose estimate leaves them")
        if self.timing.max_ticks >= MAX_TABLE:
            raise ParameterError(
                "max_ticks",
                f"must be from 2 to {MAX_TABLE - 1} with method {self.method}, not {self.timing.max_ticks}: "
                f"try --max-time {self.timing.time_of(MAX_TABLE - 1)}",
            )
        if (self.estimate == "n3" or self.bounds) and self.tick.max_count > MAX_TABLE:
            why = "estimate n3" if self.estimate == "n3" else "bounds"
            raise ParameterError(
                "max_speed", f"must be at most {MAX_TABLE} counts per tick with {why}, not {self.tick.max_count}"
            )
        if self.adaptive is not None:
            self._check_adaptive(self.adaptive)

    def _check_adaptive(self, target: Fraction) -> None:
        if self.paper_exact:
            raise ParameterError("adaptive", "must not be given with paper_exact, whose dt is constant")
        if self.lowpass is not None:
            raise ParameterError(
                "lowpass", "must not be given with adaptive: the filter counts ticks, which then differ in length"
            )
        if not 0 < target < Fraction(1, 3):
            raise ParameterError("adaptive", f"must be more than 0 and less than 1/3, not {float(target):.9g}")
        if self.timing.max_ticks < 4:
            raise ParameterError("max_ticks", f"must be at least 4 with adaptive, not {self.timing.max_ticks}")
        if not self.times.max_tick_shift:
            most = MAX_TABLE // 2
            raise ParameterError(
                "max_speed", f"must be at most {most} counts per tick with adaptive, not {self.tick.max_count}"
            )
        if self.form.adaptive_dt.fewest > self.widths.max_pulse_count:
            least = rounded(Fraction(1, 2 * self.widths.max_pulse_count - 1), up=True)
            raise ParameterError(
                "adaptive", f"must be at least {least} with this speed and time, not {float(target):.9g}"
            )

    @property
    def method_ports(self) -> tuple[Port, ...]:
        text = "Nep1 of the velocity: counts in a sampling period dt. With --paper-exact: the register Nep1 of Table 1 "
        text += "as it is, whichever of Nep1 and Ndt1 the velocity comes from."
        n_ep1 = held(UPDATE, "n_ep1", self.widths.max_pulse_count.bit_length(), unit="counts", help=text)
        text = "Ndt1 of the velocity: sampling periods dt from one count to the next. With --paper-exact: the register "
        n_dt1 = held(UPDATE, "n_dt1", self.widths.interval, unit="dt", help=text + "Ndt1 of Table 1 as it is.")
        if not self.adaptive:
            return n_ep1, n_dt1
        text = "k: dt of this measurement is 2^k times the nominal one."
        return n_ep1, n_dt1, held(UPDATE, "dt_shift", self.times.max_tick_shift.bit_length(), help=text)
