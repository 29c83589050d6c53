"""The methods that measure the time between counts share this (Tsuji 2009, Sec. IV-B and C)."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.tick import Tick
from tachometry.spec.core.times import Times, Widths
from tachometry.spec.core.velocity import Bound, Velocity
from tachometry.spec.core.words import Words
from tachometry.spec.formats.displacement import Displacement
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.port import UPDATE, Port, held
from tachometry.spec.language.units import plural

_TIMERS = ("clock", "tick")


@dataclass(frozen=True)
class Quotient:
    """Counts over a time, and the timer of that."""

    asked: Asked
    tick: Tick
    on_lattice: bool  # whether times are counted in ticks
    one_count: bool  # whether it is one count over the time since the count before
    displacement: Displacement | None  # of edges off their places

    @property
    def timer_cycles(self) -> int:
        """Clocks in a timer period; nominal, if ticks come from outside."""
        return self.asked.timing.tick_cycles if self.on_lattice else 1

    @property
    def timer_periods(self) -> int:
        """Timer periods in a tick: what counts per timer period are multiplied by."""
        return self.asked.timing.tick_cycles // self.timer_cycles

    @property
    def most_displaced(self) -> int:
        """Greatest change of a distance by displacements, in counts times the timer periods in a tick."""
        return 0 if self.displacement is None else 2 * self.displacement.most

    @property
    def silent_way(self) -> int:
        """Greatest way between the edges about a shaft, in counts times the timer periods in a tick, by the map."""
        return self.timer_periods + (0 if self.displacement is None else self.displacement.most_between)

    @property
    def max_quotient(self) -> int:
        """Greatest |N·T|/time in counts per tick, before it is saturated."""
        if self.on_lattice and not self.one_count:
            return self.tick.max_count
        return self.timer_periods + self.most_displaced

    @property
    def saturates(self) -> bool:
        """Whether a measurement can exceed the greatest pulse number."""
        return self.max_quotient > self.tick.max_count

    @property
    def flags_range(self) -> bool:
        """Whether the core needs `out_of_range`."""
        return self.saturates or (self.one_count and self.on_lattice)


@dataclass(frozen=True)
class TimedForm(Quotient):
    """Numbers of timer and divider."""

    velocity: Velocity
    decays: bool  # whether the velocity decays while no count comes

    @property
    def zeros(self) -> int:
        """Lowest bits of a distance in half counts, times the timer periods in a tick, that are always 0."""
        zeros = (self.timer_periods & -self.timer_periods).bit_length() - 1  # of 1½ counts
        return zeros if self.displacement is None else min(zeros, self.displacement.low + 1)

    @property
    def division_periods(self) -> int:
        """Timer periods within which a division is finished, if no tick is shorter than nominal."""
        return -(-self.division_clocks // self.timer_cycles)

    @property
    def may_be_late(self) -> bool:
        """Whether ticks from outside may end a measurement before a division is finished."""
        return self.on_lattice and self.asked.external_tick

    @property
    def max_periods(self) -> int:
        """Timer periods without a count after which a 0 is forced: the maximum time, or a division if longer."""
        return max(self.asked.timing.max_ticks * self.timer_periods, self.division_periods)

    @property
    def max_interval(self) -> int:
        """Longest measurement in timer periods."""
        return self.max_periods

    @property
    def remembered_periods(self) -> int:
        """Timer periods up to the end of a measurement that began after an upset, or of a silence."""
        # The time since the last count, which may wrap, and the time to the next one.
        return (1 << self.max_periods.bit_length()) + self.max_periods + 1

    @property
    def remembered(self) -> int:
        """Clocks of right counts after which nothing is remembered from before."""
        # An unrelated division may have to end first, the counter of which may be at its end.
        division = (1 << (self.quotient_bits - 1).bit_length()) + 2
        return self.remembered_periods * (self.tick.longest if self.on_lattice else 1) + division

    @property
    def _all_quotient_bits(self) -> int:
        """Bits after the sign of any quotient, and of any bound if there are bounds."""
        most = self.velocity.bound.max if self.asked.bounds else self.max_quotient
        return most.bit_length() + self.velocity.native_frac_bits

    @property
    def distance_width(self) -> int:
        """Bits of a distance in counts, times the timer periods in a tick."""
        return self.max_interval.bit_length() + self._all_quotient_bits - (self.velocity.native_frac_bits - 1)

    @property
    def quotient_bits(self) -> int:
        """Bits that the divider makes of a quotient after its sign; with bounds, as many of all quotients.

        The greatest speed is 0 in the first of them, so what is beyond all of them is seen there.
        """
        bits = self._all_quotient_bits
        if self.saturates and not self.asked.bounds:
            bits = min(bits, self.tick.max_count.bit_length() + 1 + self.velocity.native_frac_bits)
        output = self.velocity.output
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

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates."""
        clocks, tick = self.division_clocks, self.asked.timing.tick_cycles
        if not self.on_lattice or self.asked.external_tick:
            return clocks
        return tick * -(-clocks // tick)


@dataclass(frozen=True, kw_only=True)
class TimedTachometer(TachometerSpec):
    """A quotient of counts and time, by a serial divider; docs/concepts/timed.md has the rules of every case.

    A value out of range raises ParameterError.
    """

    timer: str = option("clock", "Unit in which times are counted; the paper has ticks.", choices=_TIMERS)
    bound_decay: bool = option(
        True, "Let the velocity decay while no count comes. It is 1½ counts over the time since the last one."
    )
    paper_exact: bool = option(False, "The published algorithm alone: no decay, no reversals.")

    equation: ClassVar[int]  # its number in Tsuji 2009
    one_count: ClassVar[bool]  # see `Quotient`

    @cached_property
    def _quotient(self) -> Quotient:
        return Quotient(self, self.tick, self.timer == "tick", self.one_count, self.displacement)

    @cached_property
    def bound(self) -> Bound:
        # Distance/(time − 1) is at most twice distance/time; on the lattice reversals may add a count. An edge error is
        # divided by a period at least.
        return Bound.of(self, 2 * self._quotient.max_quotient + 1, self._quotient.timer_periods)

    @cached_property
    def velocity(self) -> Velocity:
        greatest = self.tick.max_count
        if self.one_count:  # on the lattice at most one in a tick
            greatest = min(greatest, self._quotient.max_quotient)
        return Velocity(self, self.scale, self.bound, greatest)

    @cached_property
    def form(self) -> TimedForm:
        """Numbers of timer and divider."""
        decays = self.bound_decay and not self.paper_exact
        return TimedForm(**vars(self._quotient), velocity=self.velocity, decays=decays)

    @cached_property
    def latency(self) -> Latency:
        # One more clock than a division holds the result.
        return Latency(self, self.velocity, room=self.form.update_spacing, datapath=self.form.division_clocks + 1)

    @cached_property
    def times(self) -> Times:
        longest = self.form.max_periods * self.form.timer_cycles
        return replace(
            super().times,
            # No tick comes too early: it uses the divider only when that is free, and updates are a division apart.
            min_tick_cycles=2,
            longest=longest,
            standstill_ticks=-(-longest // self.timing.tick_cycles),
            interval_unit=self.form.timer_cycles,
            spacing=self.form.update_spacing,
        )

    @cached_property
    def widths(self) -> Widths:
        return replace(super().widths, interval=self.form.max_interval.bit_length())

    @property
    def remembered(self) -> int:
        return self.form.remembered

    @cached_property
    def words(self) -> Words:
        notes = self._raised("maximum time", self.timing.max_ticks * self.timing.tick_cycles, self.times.longest)
        words, description = super().words, f"eq. ({self.equation}), times in {self.timer}s"
        return replace(words, description=description, notes=(*words.notes, *notes))

    def _raised(self, what: str, given: int, built: int) -> tuple[str, ...]:
        """Return a note if a time is longer than it was asked for."""
        if built == given:
            return ()
        clocks = self.form.division_clocks
        return (f"{what} raised from {plural(given, 'clock')} to {built}: a division takes {clocks}",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.bounds and self.paper_exact:
            raise ParameterError("bounds", "must not be given with paper_exact, which has none")
        if self.displacement is not None and self.form.on_lattice:
            raise ParameterError("timer", "must be clock with --disc")

    @property
    def method_ports(self) -> tuple[Port, ...]:
        if not self.form.flags_range:
            return ()
        return (held(UPDATE, "out_of_range", help="The speed was too high to be measured; the velocity is saturated."),)

    @property
    def parameters(self) -> dict[str, Any]:
        return super().parameters | {"bound_decay": self.form.decays}
