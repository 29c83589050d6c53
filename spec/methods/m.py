"""The M method: pulses per sampling period (Tsuji 2009, Sec. IV-A)."""

from dataclasses import dataclass
from functools import cached_property

from tachometry.spec.core.facts import Facts
from tachometry.spec.core.follows import Follows
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.times import Times
from tachometry.spec.core.widths import Widths
from tachometry.spec.core.words import Words
from tachometry.spec.formats.reciprocal import Reciprocal
from tachometry.spec.language.option import option
from tachometry.spec.language.units import plural, signed_width


class MTimes(Times["MTachometer"]):
    """Says how far ticks and updates of an M-method core are apart."""

    @property
    def standstill_ticks(self) -> int:
        return self.spec.average


class MWidths(Widths["MTachometer"]):
    """Counts the bits of the numbers of an M-method core."""

    @property
    def interval(self) -> int:
        return self.spec.average.bit_length()


class MForm(Follows["MTachometer"]):
    """Finds the numbers of the datapath of the M method."""

    @property
    def max_sum(self) -> int:
        """Largest |Σ m_e| of n ticks."""
        return self.spec.average * self.spec.widths.max_count

    @property
    def sum_width(self) -> int:
        """Bits of the sum, signed."""
        return signed_width(self.max_sum)

    @property
    def shift(self) -> int | None:
        """The left shift of the sum, where n is a power of two of at most 2^frac_bits; else None."""
        average, frac_bits = self.spec.average, self.spec.widths.native_frac_bits
        halvings = average.bit_length() - 1
        exact = average == 1 << halvings and halvings + self.spec.bound.error_bits <= frac_bits
        return frac_bits - halvings if exact else None

    @property
    def reciprocal(self) -> Reciprocal:
        """The reciprocal 1/n, where a shift is not enough."""
        spec = self.spec
        frac_bits, error_bits = spec.widths.native_frac_bits, spec.bound.error_bits
        return Reciprocal(spec.average, self.max_numerator, frac_bits, error_bits, spec.bounds)

    @property
    def margin(self) -> int:
        """How far the sum is off for the bounds, in 2^−error_bits counts."""
        return int(self.spec.bound.uncertainty * (1 << self.spec.bound.error_bits))

    @property
    def max_numerator(self) -> int:
        """Largest |N| that is multiplied by the reciprocal, in 2^−error_bits counts."""
        return (self.max_sum << self.spec.bound.error_bits) + self.spec.bounds * self.margin

    @property
    def numerator_width(self) -> int:
        """Bits of the number that is multiplied by the reciprocal, signed."""
        return signed_width(self.max_numerator)


class MLatency(Latency["MTachometer"]):
    """Counts the clocks from a pin to the velocity of an M-method core."""

    @property
    def serial(self) -> bool:
        form = self.spec.form
        return form.shift is None and self.spec.times.has_room(form.reciprocal.digits + 1)

    @property
    def datapath(self) -> int:
        form = self.spec.form
        if form.shift is not None:
            return 1
        # One clock for the sum, one to load it, one for each addition, one for the result.
        return 3 + (form.reciprocal.digits if self.serial else form.numerator_width)


class MRecovery(Recovery["MTachometer"]):
    """Says how long an M-method core takes until all is right again after an upset."""

    @property
    def remembered(self) -> int:
        # After an upset the place in the memory may have to begin anew.
        return (self.spec.average + 1) * self.spec.times.longest_tick


class MWords(Words["MTachometer"]):
    """Says of an M-method core what commands show."""

    @property
    def description(self) -> str:
        return f"eq. (6), mean of {plural(self.spec.average, 'tick')}"


@dataclass(frozen=True, kw_only=True)
class MTachometer(TachometerSpec):
    """Describes an M-method tachometer, which shows the mean pulse number of the last n ticks at every tick.

    Velocity is eq. (6) of Tsuji 2009, in counts per tick, correctly rounded. Ticks before the first count as empty. A
    value out of range raises ParameterError.
    """

    average: int = option(
        1, "Ticks that are averaged, 1 to 256.", metavar="N", unit="ticks", limits=(1, 256), tests=("", "2", "3", "8")
    )

    method = "m"
    facts = Facts(title="M", summary="counts the pulses of one tick, or of several", update_by="tick")
    form = cached_property(MForm)
    times = cached_property(MTimes)
    widths = cached_property(MWidths)
    latency = cached_property(MLatency)
    recovery = cached_property(MRecovery)
    words = cached_property(MWords)
