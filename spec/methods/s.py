"""The S method of Tsuji 2009, Sec. V."""

from dataclasses import dataclass

from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.reciprocal import DividedReciprocal, NarrowReciprocal, Reciprocal
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.units import plural, signed_width

# Up to this many ticks 1/m_s can be looked up in a table of block RAM.
MAX_TABLE = 2048
_SOURCES = ("serial", "table")


@dataclass(frozen=True, kw_only=True)
class STachometer(TachometerSpec):
    """S-method tachometer: averages in step with the alterations of the pulse number.

    Velocity is eq. (21) of Tsuji 2009, or eq. (17) without cancelling, in counts per tick, correctly rounded.

    Parameters
    ----------
    cancel : bool
        Cancel alternate pulse alterations: eq. (21) instead of eq. (17).
    reciprocal_source : str
        Where 1/m_s comes from if ticks leave the time: `serial`, a division, or `table`, a block RAM. Otherwise from
        the other; and where ticks are too short for both, it is carried along.

    Raises
    ------
    ValueError
        If a parameter is out of range.
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
    summary = "averages in step with the alterations of the pulse number"
    update_by = "alteration"
    pairs_all = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.reciprocal_source not in _SOURCES:
            raise ParameterError("reciprocal", f"must be serial or table, not {self.reciprocal_source!r}")

    @property
    def description(self) -> str:
        return "eq. (21), cancels alternate alterations" if self.cancel else "eq. (17)"

    @property
    def heading(self) -> str:
        return f"{super().heading}, eq. ({21 if self.cancel else 17})"

    @property
    def remark(self) -> str:
        return (
            "At a multiple of the unit velocity m_s would be infinite. At one, and nearer to it than "
            f"1/{self.timing.max_ticks} of the unit,\nupdates are forced, and Q_V is the bound of their error."
        )

    @property
    def standstill_ticks(self) -> int:
        # The count opens a window; the forced update at its end still weights it by one half, the next no longer
        # contains it.
        return 2 * self.timing.max_ticks - self.kept_ticks

    @property
    def kept_ticks(self) -> int:
        """Ticks of the window that a forced update leaves open: its newer half."""
        return self.timing.max_ticks // 2

    @property
    def max_numerator(self) -> int:
        """Largest |N| of ω = b + N/(2·m_s), N = d0 + d1 (eq. 21), or ω = b + N/m_s, N = d1 (eq. 17)."""
        return 2 * self.max_count * self.numerator_per_count + self.bounds * self.margin

    @property
    def numerator_per_count(self) -> int:
        """The number that one count adds to N: 2 in eq. (21), whose N is of half counts, and 1 in eq. (17); or finer
        parts.
        """
        return (2 if self.cancel else 1) << self.finer

    @property
    def finer(self) -> int:
        """Bits by which N is finer than the counts, for an edge error that is a fraction."""
        return max(0, self.error_bits - self.cancel)

    @property
    def margin(self) -> int:
        """How far N is off for the bounds."""
        return int(self.uncertainty * self.numerator_per_count)

    @property
    def tick_latency(self) -> int:
        # What saturates has registers of its own: before the sum, and behind it.
        return super().tick_latency + 2 * (self.max_count < self.longest_tick)

    @property
    def reciprocal(self) -> Reciprocal | CarriedReciprocal:
        """The reciprocal of m_s: the first that there is room for, as `reciprocal_source` says; else carried along."""
        shape = (self.timing.max_ticks, self.max_numerator, self.native_frac_bits, self.cancel + self.finer)
        found = self.looked_up
        fitting = [found] if self.timing.max_ticks <= MAX_TABLE and self.has_room(self._busy_clocks(found)) else []
        divided = DividedReciprocal(*shape, self.bounds)
        if self.has_room(self._busy_clocks(divided)):
            fitting.insert(0 if self.reciprocal_source == "serial" else len(fitting), divided)
        return fitting[0] if fitting else CarriedReciprocal(*shape, entry=self.kept_ticks + 1)

    @property
    def looked_up(self) -> Reciprocal:
        """The reciprocal of m_s as a table, whether there is room for it or not."""
        shape = (self.timing.max_ticks, self.max_numerator, self.native_frac_bits, self.cancel + self.finer)
        found = Reciprocal(*shape, self.bounds)
        return found if found.bounds or found.has_ties else NarrowReciprocal(*shape)

    def _busy_clocks(self, reciprocal: Reciprocal) -> int:
        # One clock to start over with a new m_s, then a table takes two, and a division as many as its bits.
        found = reciprocal.steps + 1 if isinstance(reciprocal, DividedReciprocal) else 2
        return self._serial_latency(reciprocal) + 1 + found

    @property
    def carried(self) -> bool:
        """Whether the reciprocal is carried along."""
        return isinstance(self.reciprocal, CarriedReciprocal)

    @property
    def memory(self) -> tuple[str, int, int] | None:
        """The memory of the reciprocal: its kind, entries, bits of an entry."""
        if isinstance(self.reciprocal, DividedReciprocal):
            return None
        return "table and carried on" if self.carried else "table", self.reciprocal.depth, self.reciprocal.width

    @property
    def division(self) -> str:
        reciprocal = self.reciprocal
        if not isinstance(reciprocal, DividedReciprocal):
            return ""
        bits = self.native_width + reciprocal.scale_bits
        two = f"; two adders for sums of {bits} bits" if reciprocal.is_wide(self.native_width) else ""
        return f"divided in {reciprocal.steps + 1} clocks between two ticks{two}"

    @property
    def notes(self) -> tuple[str, ...]:
        divided = isinstance(self.reciprocal, DividedReciprocal)
        if divided == (self.reciprocal_source == "serial") and not self.carried:
            return super().notes
        short = f"a tick of {plural(self.timing.tick_cycles, 'clock')} is too short to"
        large = self.timing.max_ticks > MAX_TABLE
        no_table = f"a table has at most {MAX_TABLE} entries" if large else f"{short} look it up"
        if divided:
            reason = f"divided: {no_table}"
        elif not self.carried:
            reason = f"from a table: {short} divide between two"
        else:
            reason = f"carried along: {short} divide between two, {f'and {no_table}' if large else 'or to look it up'}"
        return (*super().notes, f"reciprocal {reason}")

    @property
    def numerator_width(self) -> int:
        """Bits of N, signed; a product with N takes as many additions."""
        return signed_width(self.max_numerator)

    @property
    def remembered_clocks(self) -> int:
        # The open window, whose length may wrap, and the next one.
        return ((1 << self.interval_width) + self.timing.max_ticks + 1) * self.longest_tick

    @property
    def serial(self) -> bool:
        """Whether ticks are far enough apart for one adder to form the velocity step by step."""
        return not self.carried

    @property
    def busy_clocks(self) -> int:
        reciprocal = self.reciprocal
        assert isinstance(reciprocal, Reciprocal)
        return self._busy_clocks(reciprocal)

    @property
    def datapath_latency(self) -> int:
        reciprocal = self.reciprocal
        if isinstance(reciprocal, Reciprocal):
            return self._serial_latency(reciprocal)
        # One clock for the table, one for its register, one for each bit of N and each digit of N·R/m, one to add b.
        return self.numerator_width + reciprocal.digits + 3

    def _serial_latency(self, reciprocal: Reciprocal) -> int:
        # One clock for the product of each digit, which is added in the next.
        return reciprocal.digits + 1
