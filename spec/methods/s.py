"""The S method of Tsuji 2009, Sec. V."""

from dataclasses import dataclass, replace
from functools import cached_property

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.tick import Tick
from tachometry.spec.core.times import Times
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.core.words import Words
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.displacement import Displacement
from tachometry.spec.formats.reciprocal import DividedReciprocal, NarrowReciprocal, Reciprocal
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.units import plural, signed_width

# Up to this many ticks 1/m_s can be looked up in a table of block RAM.
MAX_TABLE = 2048
_SOURCES = ("serial", "table")


@dataclass(frozen=True)
class SForm:
    """Numbers of the datapath of the S method."""

    asked: Asked
    tick: Tick
    velocity: Velocity
    cancel: bool  # whether alternate alterations cancel, eq. (21)
    source: str  # of the reciprocal, if there is room for it
    displacement: Displacement | None = None  # of edges off their places

    @property
    def kept_ticks(self) -> int:
        """Ticks of the window that a forced update leaves open: its newer half."""
        return self.asked.timing.max_ticks // 2

    @property
    def rest_divisor(self) -> int:
        """After a long rest, the first update at one count per tick has at most the speed divided by this."""
        return (self.kept_ticks + 1) * (2 if self.cancel else 1)

    @property
    def max_numerator(self) -> int:
        """Largest |N| of ω = b + N/(2·m_s), N = d0 + d1 (eq. 21), or ω = b + N/m_s, N = d1 (eq. 17)."""
        off = 0 if self.displacement is None else 4 * self.displacement.most  # of two edges at both ends
        return 2 * self.tick.max_count * self.numerator_per_count + self.asked.bounds * self.margin + off

    @property
    def numerator_width(self) -> int:
        """Bits of N, signed; a product with N takes as many additions."""
        return signed_width(self.max_numerator)

    @property
    def numerator_per_count(self) -> int:
        """The number that one count adds to N: 2 in eq. (21), of half counts, and 1 in eq. (17); or finer parts."""
        return (2 if self.cancel else 1) << self.finer

    @property
    def finer(self) -> int:
        """Bits by which N is finer than the counts, for an edge error that is a fraction, or displacements."""
        if self.displacement is not None:
            return self.displacement.per_count.bit_length() - 1
        return max(0, self.velocity.bound.error_bits - self.cancel)

    @property
    def margin(self) -> int:
        """How far N is off for the bounds."""
        return int(self.velocity.bound.uncertainty * self.numerator_per_count)

    @property
    def _shape(self) -> tuple[int, int, int, int]:
        ticks, frac_bits = self.asked.timing.max_ticks, self.velocity.native_frac_bits
        return ticks, self.max_numerator, frac_bits, self.cancel + self.finer

    @cached_property
    def reciprocal(self) -> Reciprocal | CarriedReciprocal:
        """The reciprocal of m_s: the first that there is room for, by `source`; else carried along."""
        table, divided = self.looked_up, DividedReciprocal(*self._shape, self.asked.bounds)
        has_table = self.asked.timing.max_ticks <= MAX_TABLE and _busy_clocks(table) <= self.tick.room
        fitting = [table] if has_table else []
        if _busy_clocks(divided) <= self.tick.room:
            fitting.insert(0 if self.source == "serial" else len(fitting), divided)
        return fitting[0] if fitting else CarriedReciprocal(*self._shape, entry=self.kept_ticks + 1)

    @property
    def looked_up(self) -> Reciprocal:
        """The reciprocal of m_s as a table, whether there is room for it or not."""
        found = Reciprocal(*self._shape, self.asked.bounds)
        return found if found.bounds or found.has_ties else NarrowReciprocal(*self._shape)

    @property
    def carried(self) -> bool:
        """Whether the reciprocal is carried along."""
        return isinstance(self.reciprocal, CarriedReciprocal)

    @property
    def busy(self) -> int:
        """Clocks that a velocity takes from tick to tick; 0 if the reciprocal is carried along."""
        return _busy_clocks(self.reciprocal) if isinstance(self.reciprocal, Reciprocal) else 0

    @property
    def clocks(self) -> int:
        """Clocks from `tick` to the native velocity."""
        if isinstance(self.reciprocal, Reciprocal):
            return _serial_clocks(self.reciprocal)
        # One clock for the table, one for its register, one for each bit of N and each digit of N·R/m, one to add b.
        return self.numerator_width + self.reciprocal.digits + 3


def _busy_clocks(reciprocal: Reciprocal) -> int:
    """Return the clocks from tick to tick that a velocity takes with a reciprocal, where it is formed step by step."""
    # One clock to start over with a new m_s, then a table takes two, and a division as many as its bits.
    found = reciprocal.steps + 1 if isinstance(reciprocal, DividedReciprocal) else 2
    return _serial_clocks(reciprocal) + 1 + found


def _serial_clocks(reciprocal: Reciprocal) -> int:
    # One clock for the product of each digit, which is added in the next.
    return reciprocal.digits + 1


_RECIPROCAL_SOURCE = """Source of the reciprocal of the measurement time. serial divides between two ticks, table \
looks it up in block RAM. Where ticks are too short for the one, or windows too long, the other is taken; where \
neither is possible, it is carried from tick to tick."""


@dataclass(frozen=True, kw_only=True)
class STachometer(TachometerSpec):
    """Averages in step with the alterations of the pulse number (S method).

    Velocity is eq. (21) of Tsuji 2009, or eq. (17) without cancelling, in counts per tick, correctly rounded. A value
    out of range raises ParameterError.
    """

    cancel: bool = option(True, "Cancel alternate pulse alterations, eq. (21). Otherwise they are averaged, eq. (17).")

    reciprocal_source: str = option("serial", _RECIPROCAL_SOURCE, name="reciprocal", choices=_SOURCES)

    method = "s"
    facts = Facts(
        title="S",
        summary="averages in step with the alterations of the pulse number",
        update_by="alteration",
        interval="m_s in ticks",
        forced="No alteration closed this window: the maximum time passed.",
        pairs_all=True,
    )

    @cached_property
    def form(self) -> SForm:
        """Numbers of the datapath."""
        return SForm(self, self.tick, self.velocity, self.cancel, self.reciprocal_source, self.displacement)

    @cached_property
    def velocity(self) -> Velocity:
        # Displacements at both ends of a window of a tick add to its mean.
        if (off := self.displacement) is None:
            return super().velocity
        most = self.tick.max_count - (-2 * off.most // off.per_count)
        # An LSB is no more than the unit of displacements.
        return Velocity(self, self.scale, self.bound, most, least_native_frac_bits=off.per_count.bit_length())

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.displacement is not None and not self.cancel:
            raise ParameterError("cancel", "must be yes with --disc")

    @cached_property
    def latency(self) -> Latency:
        # What saturates has registers of its own: before the sum, and behind it. Displacements come as late.
        tick = 2 + 2 * (self.tick.max_count < self.tick.longest or self.displacement is not None)
        return Latency(self, self.velocity, self.tick.room, self.form.clocks, self.form.busy, tick)

    @cached_property
    def times(self) -> Times:
        # The count opens a window; the forced update at its end still weights it by one half, the next no longer
        # contains it.
        return replace(super().times, standstill_ticks=2 * self.timing.max_ticks - self.form.kept_ticks)

    @property
    def remembered(self) -> int:
        # The open window, whose length may wrap, and the next one.
        ticks = self.timing.max_ticks
        return ((1 << ticks.bit_length()) + ticks + 1) * self.tick.longest

    @cached_property
    def words(self) -> Words:
        words, equation, divisor = super().words, 21 if self.cancel else 17, self.form.rest_divisor
        step = "1/(2*m_s) of the step" if self.cancel else "1/m_s of the step"
        return replace(
            words,
            description="eq. (21), cancels alternate alterations" if self.cancel else "eq. (17)",
            heading=f"{words.heading}, eq. ({equation})",
            remark="At a multiple of the unit velocity m_s would be infinite. At one, and nearer to it than "
            f"1/{self.timing.max_ticks} of the unit,\nupdates are forced, and Q_V is the bound of their error.\n"
            f"After a step to a multiple the velocity stays that before it for the maximum time, but for {step}: "
            f"from rest\nto exactly one count per tick at most 1/{divisor} of the speed is shown till then.",
            memory=self._memory,
            division=self._division,
            notes=(*words.notes, *self._notes),
        )

    @property
    def _memory(self) -> tuple[str, int, int] | None:
        reciprocal = self.form.reciprocal
        if isinstance(reciprocal, DividedReciprocal):
            return None
        return "table and carried on" if self.form.carried else "table", reciprocal.depth, reciprocal.width

    @property
    def _division(self) -> str:
        reciprocal = self.form.reciprocal
        if not isinstance(reciprocal, DividedReciprocal):
            return ""
        native = self.velocity.native
        two = f"; two adders for sums of {native + reciprocal.scale_bits} bits" if reciprocal.is_wide(native) else ""
        return f"divided in {reciprocal.steps + 1} clocks between two ticks{two}"

    @property
    def _notes(self) -> tuple[str, ...]:
        divided = isinstance(self.form.reciprocal, DividedReciprocal)
        if divided == (self.reciprocal_source == "serial") and not self.form.carried:
            return ()
        short = f"a tick of {plural(self.timing.tick_cycles, 'clock')} is too short to"
        large = self.timing.max_ticks > MAX_TABLE
        no_table = f"a table has at most {MAX_TABLE} entries" if large else f"{short} look it up"
        if divided:
            return (f"reciprocal divided: {no_table}",)
        if not self.form.carried:
            return (f"reciprocal from a table: {short} divide between two",)
        why = f"and {no_table}" if large else "or to look it up"
        return (f"reciprocal carried along: {short} divide between two, {why}",)
