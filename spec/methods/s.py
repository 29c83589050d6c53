"""The S method of Tsuji 2009, Sec. V."""

from dataclasses import dataclass

from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.reciprocal import Reciprocal
from tachometry.spec.option import option
from tachometry.spec.tachometer import TachometerSpec
from tachometry.spec.units import signed_width

# Up to this many ticks 1/m_s is looked up in a table of block RAM; for longer measurements it is carried along.
MAX_TABLE = 2048


@dataclass(frozen=True, kw_only=True)
class STachometer(TachometerSpec):
    """S-method tachometer: averages in step with the alterations of the pulse number.

    Velocity is eq. (21) of Tsuji 2009, or eq. (17) without cancelling, in counts per tick, correctly rounded.

    Parameters
    ----------
    cancel : bool
        Cancel alternate pulse alterations: eq. (21) instead of eq. (17).

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    cancel: bool = option(True, "Cancel alternate pulse alterations, eq. (21), or average plainly, eq. (17).")

    method = "s"
    summary = "averages in step with the alterations of the pulse number"
    update_by = "alteration"
    pairs_all = True

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
        """What one count adds to N: 2 in eq. (21), whose N is of half counts, and 1 in eq. (17); or finer parts."""
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
    def reciprocal(self) -> Reciprocal | CarriedReciprocal:
        """The reciprocal of m_s: looked up, or carried along where a table would be large."""
        shape = (self.timing.max_ticks, self.max_numerator, self.native_frac_bits, self.cancel + self.finer)
        carried = CarriedReciprocal(*shape, entry=self.kept_ticks + 1)
        return carried if self.timing.max_ticks > max(MAX_TABLE, carried.depth) else Reciprocal(*shape)

    @property
    def carried(self) -> bool:
        """Whether the reciprocal is carried along."""
        return isinstance(self.reciprocal, CarriedReciprocal)

    @property
    def memory(self) -> tuple[str, int, int]:
        """The memory of the reciprocal: its kind, entries, bits of an entry."""
        return "table and carried on" if self.carried else "table", self.reciprocal.depth, self.reciprocal.width

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
        return self.has_room(self._serial_latency)

    @property
    def datapath_latency(self) -> int:
        return self._serial_latency if self.serial else self._pipelined_latency

    @property
    def _serial_latency(self) -> int:
        # One clock for the table, one for its register, one for each bit of N, one to add b. A carried reciprocal takes
        # one more for every digit of N·R/m, and one to round.
        return 2 * self.numerator_width + 4 if self.carried else self.numerator_width + 3

    @property
    def _pipelined_latency(self) -> int:
        reciprocal = self.reciprocal
        digits = reciprocal.digits if isinstance(reciprocal, CarriedReciprocal) else 0
        return self.numerator_width + digits + 3
