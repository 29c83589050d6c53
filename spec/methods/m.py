"""The M method: pulses per sampling period (Tsuji 2009, Sec. IV-A)."""

from dataclasses import dataclass

from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.formats.reciprocal import Reciprocal
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.units import plural, signed_width

MAX_AVERAGE = 256


@dataclass(frozen=True, kw_only=True)
class MTachometer(TachometerSpec):
    """M-method tachometer: an update every tick, the mean pulse number of the last n ticks.

    Velocity is eq. (6) of Tsuji 2009, in counts per tick, correctly rounded. Ticks before the first count as empty.

    Parameters
    ----------
    average : int
        n, ticks that are averaged.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    average: int = option(1, "Ticks that are averaged, 1 to 256.", metavar="N", unit="ticks", tests=("", "2", "3", "8"))

    method = "m"
    summary = "counts the pulses of one tick, or of several"

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 1 <= self.average <= MAX_AVERAGE:
            raise ParameterError("average", f"must be from 1 to {MAX_AVERAGE}, not {self.average}")

    @property
    def description(self) -> str:
        return f"eq. (6), mean of {plural(self.average, 'tick')}"

    @property
    def standstill_ticks(self) -> int:
        return self.average

    @property
    def max_sum(self) -> int:
        """Largest |Σ m_e| of n ticks."""
        return self.average * self.max_count

    @property
    def sum_width(self) -> int:
        """Bits of the sum, signed."""
        return signed_width(self.max_sum)

    @property
    def shift(self) -> int | None:
        """The left shift of the sum, where n is a power of two of at most 2^frac_bits; else None."""
        halvings = self.average.bit_length() - 1
        exact = self.average == 1 << halvings and halvings + self.error_bits <= self.native_frac_bits
        return self.native_frac_bits - halvings if exact else None

    @property
    def reciprocal(self) -> Reciprocal:
        """The reciprocal 1/n, where a shift is not enough."""
        return Reciprocal(self.average, self.max_numerator, self.native_frac_bits, self.error_bits, self.bounds)

    @property
    def margin(self) -> int:
        """How far the sum is off for the bounds, in 2^−error_bits counts."""
        return int(self.uncertainty * (1 << self.error_bits))

    @property
    def max_numerator(self) -> int:
        """Largest |N| that is multiplied by the reciprocal, in 2^−error_bits counts."""
        return (self.max_sum << self.error_bits) + self.bounds * self.margin

    @property
    def numerator_width(self) -> int:
        """Bits of the number that is multiplied by the reciprocal, signed."""
        return signed_width(self.max_numerator)

    @property
    def interval_width(self) -> int:
        return self.average.bit_length()

    @property
    def remembered_clocks(self) -> int:
        # After an upset the place in the memory may have to begin anew.
        return (self.average + 1) * self.longest_tick

    @property
    def serial(self) -> bool:
        return self.shift is None and self.has_room(self.reciprocal.digits + 1)

    @property
    def datapath_latency(self) -> int:
        if self.shift is not None:
            return 1
        # One clock for the sum, one to load it, one for each addition, one for the result.
        return 3 + (self.reciprocal.digits if self.serial else self.numerator_width)
