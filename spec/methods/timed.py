"""The methods that measure the time between counts share this (Tsuji 2009, Sec. IV-B and C)."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, TypeVar

from tachometry.spec.core.bound import Bound
from tachometry.spec.core.follows import Follows
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.times import Times
from tachometry.spec.core.widths import Widths
from tachometry.spec.core.words import Words
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.port import UPDATE, Port, held
from tachometry.spec.language.units import plural

_TIMERS = ("clock", "tick")
T = TypeVar("T", bound="TimedTachometer", covariant=True)


class TimedForm(Follows[T]):
    """Finds the numbers of timer and divider."""

    equation: ClassVar[int]  # its number in Tsuji 2009

    @property
    def on_lattice(self) -> bool:
        """Whether times are counted in ticks."""
        return self.spec.timer == "tick"

    @property
    def decays(self) -> bool:
        """Whether the velocity decays while no count comes."""
        return self.spec.bound_decay and not self.spec.paper_exact

    @property
    def timer_cycles(self) -> int:
        """Clocks in a timer period; nominal, if ticks come from outside."""
        return self.spec.timing.tick_cycles if self.on_lattice else 1

    @property
    def timer_periods(self) -> int:
        """Timer periods in a tick: what counts per timer period are multiplied by."""
        return self.spec.timing.tick_cycles // self.timer_cycles

    @property
    def division_periods(self) -> int:
        """Timer periods within which a division is finished, if no tick is shorter than nominal."""
        return -(-self.division_clocks // self.timer_cycles)

    @property
    def may_be_late(self) -> bool:
        """Whether ticks from outside may end a measurement before a division is finished."""
        return self.on_lattice and self.spec.external_tick

    @property
    def max_periods(self) -> int:
        """Timer periods without a count after which a 0 is forced: the maximum time, or a division if longer."""
        return max(self.spec.timing.max_ticks * self.timer_periods, self.division_periods)

    @property
    def max_interval(self) -> int:
        """Longest measurement in timer periods."""
        raise NotImplementedError

    @property
    def remembered_periods(self) -> int:
        """Timer periods up to the end of a measurement that began after an upset, or of a silence."""
        raise NotImplementedError

    @property
    def max_quotient(self) -> int:
        """Greatest |N·T|/time in counts per tick, before it is saturated."""
        return self.spec.widths.max_count if self.on_lattice else self.spec.timing.tick_cycles

    @property
    def saturates(self) -> bool:
        """Whether a measurement can exceed the greatest pulse number."""
        return self.max_quotient > self.spec.widths.max_count

    @property
    def flags_range(self) -> bool:
        """Whether the core needs `out_of_range`."""
        return self.saturates

    @property
    def _all_quotient_bits(self) -> int:
        """Bits after the sign of any quotient, and of any bound if there are bounds."""
        most = self.spec.bound.max if self.spec.bounds else self.max_quotient
        return most.bit_length() + self.spec.widths.native_frac_bits

    @property
    def distance_width(self) -> int:
        """Bits of a distance in counts, times the timer periods in a tick."""
        return self.spec.widths.interval + self._all_quotient_bits - (self.spec.widths.native_frac_bits - 1)

    @property
    def quotient_bits(self) -> int:
        """Bits that the divider makes of a quotient after its sign; with bounds, as many of all quotients.

        The greatest speed is 0 in the first of them, so what is beyond all of them is seen there.
        """
        bits, widths = self._all_quotient_bits, self.spec.widths
        if self.saturates and not self.spec.bounds:
            bits = min(bits, widths.max_count.bit_length() + 1 + widths.native_frac_bits)
        output = self.spec.scale.output
        if output is None or len(output.digits) < 3:
            return bits
        # Up to two more are worth it if updates are then so far apart that the unit takes one adder.
        more = output.serial_latency - (bits + 2)
        return bits + more if more in (1, 2) else bits

    @property
    def division_clocks(self) -> int:
        """Clocks from one division to the next."""
        # A clock for the dividend, and one for each digit, its sign included.
        return self.quotient_bits + 2


class TimedTimes(Times[T]):
    """Says how far ticks and updates are apart."""

    @property
    def longest(self) -> int:
        return self.spec.form.max_periods * self.spec.form.timer_cycles

    @property
    def standstill_ticks(self) -> int:
        return -(-self.longest // self.spec.timing.tick_cycles)

    @property
    def interval_unit(self) -> int:
        return self.spec.form.timer_cycles

    @property
    def min_tick_cycles(self) -> int:
        # No tick comes too early: it uses the divider only when that is free, and updates are a division apart.
        return 2

    @property
    def update_spacing(self) -> int:
        clocks = self.spec.form.division_clocks
        if not self.spec.form.on_lattice or self.spec.external_tick:
            return clocks
        return self.spec.timing.tick_cycles * -(-clocks // self.spec.timing.tick_cycles)


class TimedWidths(Widths[T]):
    """Counts the bits of the numbers, and the greatest of them."""

    @property
    def interval(self) -> int:
        return self.spec.form.max_interval.bit_length()


class TimedBound(Bound[T]):
    """Finds the numbers of what encloses the true speed."""

    @property
    def max(self) -> int:
        # Distance/(time − 1) is at most twice distance/time; on the lattice reversals may add a count. An edge error is
        # divided by a period at least.
        form = self.spec.form
        return 2 * form.max_quotient + 1 + math.ceil(self.edge_error * form.timer_periods)


class TimedLatency(Latency[T]):
    """Counts the clocks from a pin to the velocity."""

    @property
    def serial(self) -> bool:
        return False

    @property
    def datapath(self) -> int:
        # One more clock holds the result.
        return self.spec.form.division_clocks + 1

    def _has_room(self, clocks: int) -> bool:
        return self.spec.times.update_spacing >= clocks


class TimedRecovery(Recovery[T]):
    """Says how long it takes until all is right again after an upset."""

    @property
    def remembered(self) -> int:
        form = self.spec.form
        # An unrelated division may have to end first, the counter of which may be at its end.
        division = (1 << (form.quotient_bits - 1).bit_length()) + 2
        return form.remembered_periods * (self.spec.times.longest_tick if form.on_lattice else 1) + division


class TimedWords(Words[T]):
    """Says of a core that measures the time between counts what commands show."""

    @property
    def description(self) -> str:
        return f"eq. ({self.spec.form.equation}), times in {self.spec.timer}s"

    @property
    def notes(self) -> tuple[str, ...]:
        given = self.spec.timing.max_ticks * self.spec.timing.tick_cycles
        return (*super().notes, *self._raised("maximum time", given, self.spec.times.longest))

    def _raised(self, what: str, given: int, built: int) -> tuple[str, ...]:
        """Return a note if a time is longer than it was asked for."""
        if built == given:
            return ()
        clocks = self.spec.form.division_clocks
        return (f"{what} raised from {plural(given, 'clock')} to {built}: a division takes {clocks}",)


@dataclass(frozen=True, kw_only=True)
class TimedTachometer(TachometerSpec):
    """A quotient of counts and time, by a serial divider; docs/concepts/timed.md has the rules of every case.

    A value out of range raises ParameterError.
    """

    timer: str = option("clock", "What times are counted in: clocks, or ticks as in the paper.", choices=_TIMERS)
    bound_decay: bool = option(
        True, "While no count comes, let the velocity decay as 1½ counts over the time since the last one."
    )
    paper_exact: bool = option(
        False, "The published algorithm and nothing else: no decay, and a reversal is no special case."
    )

    form = cached_property(TimedForm["TimedTachometer"])
    times = cached_property(TimedTimes["TimedTachometer"])
    widths = cached_property(TimedWidths["TimedTachometer"])
    bound = cached_property(TimedBound["TimedTachometer"])
    latency = cached_property(TimedLatency["TimedTachometer"])
    recovery = cached_property(TimedRecovery["TimedTachometer"])
    words = cached_property(TimedWords["TimedTachometer"])

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bounds and self.paper_exact:
            raise ParameterError("bounds", "must not be given with paper_exact, which has none")

    @property
    def method_ports(self) -> tuple[Port, ...]:
        if not self.form.flags_range:
            return ()
        return (held(UPDATE, "out_of_range", help="The speed was too high to be measured; the velocity is saturated."),)

    @property
    def parameters(self) -> dict[str, Any]:
        return super().parameters | {"bound_decay": self.form.decays}
