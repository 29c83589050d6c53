"""The S method of Tsuji 2009, Sec. V."""

from dataclasses import dataclass
from functools import cached_property

from tachometry.spec.core.facts import Facts
from tachometry.spec.core.follows import Follows
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.times import Times
from tachometry.spec.core.words import Words
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.reciprocal import DividedReciprocal, NarrowReciprocal, Reciprocal
from tachometry.spec.language.option import option
from tachometry.spec.language.units import plural, signed_width

# Up to this many ticks 1/m_s can be looked up in a table of block RAM.
MAX_TABLE = 2048
_SOURCES = ("serial", "table")


class STimes(Times["STachometer"]):
    """Says how far ticks and updates of an S-method core are apart."""

    @property
    def standstill_ticks(self) -> int:
        # The count opens a window; the forced update at its end still weights it by one half, the next no longer
        # contains it.
        return 2 * self.spec.timing.max_ticks - self.spec.form.kept_ticks


class SForm(Follows["STachometer"]):
    """Finds the numbers of the datapath of the S method."""

    @property
    def kept_ticks(self) -> int:
        """Ticks of the window that a forced update leaves open: its newer half."""
        return self.spec.timing.max_ticks // 2

    @property
    def rest_divisor(self) -> int:
        """After a long rest, the first update at one count per tick has at most the speed divided by this."""
        return (self.kept_ticks + 1) * (2 if self.spec.cancel else 1)

    @property
    def max_numerator(self) -> int:
        """Largest |N| of ω = b + N/(2·m_s), N = d0 + d1 (eq. 21), or ω = b + N/m_s, N = d1 (eq. 17)."""
        return 2 * self.spec.widths.max_count * self.numerator_per_count + self.spec.bounds * self.margin

    @property
    def numerator_width(self) -> int:
        """Bits of N, signed; a product with N takes as many additions."""
        return signed_width(self.max_numerator)

    @property
    def numerator_per_count(self) -> int:
        """The number that one count adds to N: 2 in eq. (21), of half counts, and 1 in eq. (17); or finer parts."""
        return (2 if self.spec.cancel else 1) << self.finer

    @property
    def finer(self) -> int:
        """Bits by which N is finer than the counts, for an edge error that is a fraction."""
        return max(0, self.spec.bound.error_bits - self.spec.cancel)

    @property
    def margin(self) -> int:
        """How far N is off for the bounds."""
        return int(self.spec.bound.uncertainty * self.numerator_per_count)

    @property
    def _shape(self) -> tuple[int, int, int, int]:
        spec = self.spec
        return spec.timing.max_ticks, self.max_numerator, spec.widths.native_frac_bits, spec.cancel + self.finer

    @cached_property
    def reciprocal(self) -> Reciprocal | CarriedReciprocal:
        """The reciprocal of m_s: the first that there is room for, as `reciprocal_source` says; else carried along."""
        spec, found = self.spec, self.looked_up
        has_table = spec.timing.max_ticks <= MAX_TABLE and spec.times.has_room(busy_clocks(found))
        fitting = [found] if has_table else []
        divided = DividedReciprocal(*self._shape, spec.bounds)
        if spec.times.has_room(busy_clocks(divided)):
            fitting.insert(0 if spec.reciprocal_source == "serial" else len(fitting), divided)
        return fitting[0] if fitting else CarriedReciprocal(*self._shape, entry=self.kept_ticks + 1)

    @property
    def looked_up(self) -> Reciprocal:
        """The reciprocal of m_s as a table, whether there is room for it or not."""
        found = Reciprocal(*self._shape, self.spec.bounds)
        return found if found.bounds or found.has_ties else NarrowReciprocal(*self._shape)

    @property
    def carried(self) -> bool:
        """Whether the reciprocal is carried along."""
        return isinstance(self.reciprocal, CarriedReciprocal)


class SLatency(Latency["STachometer"]):
    """Counts the clocks from a pin to the velocity of an S-method core."""

    @property
    def tick(self) -> int:
        # What saturates has registers of its own: before the sum, and behind it.
        return super().tick + 2 * (self.spec.widths.max_count < self.spec.times.longest_tick)

    @property
    def serial(self) -> bool:
        """Whether ticks are far enough apart for one adder to form the velocity step by step."""
        return not self.spec.form.carried

    @property
    def busy(self) -> int:
        reciprocal = self.spec.form.reciprocal
        assert isinstance(reciprocal, Reciprocal)
        return busy_clocks(reciprocal)

    @property
    def datapath(self) -> int:
        reciprocal = self.spec.form.reciprocal
        if isinstance(reciprocal, Reciprocal):
            return _serial_clocks(reciprocal)
        # One clock for the table, one for its register, one for each bit of N and each digit of N·R/m, one to add b.
        return self.spec.form.numerator_width + reciprocal.digits + 3


def busy_clocks(reciprocal: Reciprocal) -> int:
    """Return the clocks from tick to tick that a velocity takes with a reciprocal, where it is formed step by step."""
    # One clock to start over with a new m_s, then a table takes two, and a division as many as its bits.
    found = reciprocal.steps + 1 if isinstance(reciprocal, DividedReciprocal) else 2
    return _serial_clocks(reciprocal) + 1 + found


def _serial_clocks(reciprocal: Reciprocal) -> int:
    # One clock for the product of each digit, which is added in the next.
    return reciprocal.digits + 1


class SRecovery(Recovery["STachometer"]):
    """Says how long an S-method core takes until all is right again after an upset."""

    @property
    def remembered(self) -> int:
        # The open window, whose length may wrap, and the next one.
        spec = self.spec
        return ((1 << spec.widths.interval) + spec.timing.max_ticks + 1) * spec.times.longest_tick


class SWords(Words["STachometer"]):
    """Says of an S-method core what commands show."""

    @property
    def description(self) -> str:
        return "eq. (21), cancels alternate alterations" if self.spec.cancel else "eq. (17)"

    @property
    def heading(self) -> str:
        return f"{super().heading}, eq. ({21 if self.spec.cancel else 17})"

    @property
    def remark(self) -> str:
        return (
            "At a multiple of the unit velocity m_s would be infinite. At one, and nearer to it than "
            f"1/{self.spec.timing.max_ticks} of the unit,\nupdates are forced, and Q_V is the bound of their error.\n"
            f"After a step to a multiple the velocity stays that before it for the maximum time, but for {self._step}: "
            f"from rest\nto exactly one count per tick at most 1/{self.spec.form.rest_divisor} of the speed is shown "
            "till then."
        )

    @property
    def _step(self) -> str:
        return "1/(2*m_s) of the step" if self.spec.cancel else "1/m_s of the step"

    @property
    def memory(self) -> tuple[str, int, int] | None:
        reciprocal = self.spec.form.reciprocal
        if isinstance(reciprocal, DividedReciprocal):
            return None
        return "table and carried on" if self.spec.form.carried else "table", reciprocal.depth, reciprocal.width

    @property
    def division(self) -> str:
        reciprocal = self.spec.form.reciprocal
        if not isinstance(reciprocal, DividedReciprocal):
            return ""
        native = self.spec.widths.native
        two = f"; two adders for sums of {native + reciprocal.scale_bits} bits" if reciprocal.is_wide(native) else ""
        return f"divided in {reciprocal.steps + 1} clocks between two ticks{two}"

    @property
    def notes(self) -> tuple[str, ...]:
        spec = self.spec
        divided = isinstance(spec.form.reciprocal, DividedReciprocal)
        if divided == (spec.reciprocal_source == "serial") and not spec.form.carried:
            return super().notes
        short = f"a tick of {plural(spec.timing.tick_cycles, 'clock')} is too short to"
        large = spec.timing.max_ticks > MAX_TABLE
        no_table = f"a table has at most {MAX_TABLE} entries" if large else f"{short} look it up"
        if divided:
            reason = f"divided: {no_table}"
        elif not spec.form.carried:
            reason = f"from a table: {short} divide between two"
        else:
            reason = f"carried along: {short} divide between two, {f'and {no_table}' if large else 'or to look it up'}"
        return (*super().notes, f"reciprocal {reason}")


@dataclass(frozen=True, kw_only=True)
class STachometer(TachometerSpec):
    """Averages in step with the alterations of the pulse number (S method).

    Velocity is eq. (21) of Tsuji 2009, or eq. (17) without cancelling, in counts per tick, correctly rounded. A value
    out of range raises ParameterError.
    """

    cancel: bool = option(True, "Cancel alternate pulse alterations, eq. (21), or average plainly, eq. (17).")

    reciprocal_source: str = option(
        "serial",
        "Where the reciprocal of the measurement time comes from: divided serially between two ticks, or looked up in "
        "a table of block RAM. Where ticks are too short for the one, or windows too long, the other is taken; where "
        "neither is possible, it is carried along from tick to tick.",
        name="reciprocal",
        choices=_SOURCES,
    )

    method = "s"
    facts = Facts(
        title="S",
        summary="averages in step with the alterations of the pulse number",
        update_by="alteration",
        pairs_all=True,
    )
    form = cached_property(SForm)
    times = cached_property(STimes)
    latency = cached_property(SLatency)
    recovery = cached_property(SRecovery)
    words = cached_property(SWords)
