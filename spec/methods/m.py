"""The M method: pulses per sampling period (Tsuji 2009, Sec. IV-A)."""

from dataclasses import dataclass, replace
from functools import cached_property

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.tick import Tick
from tachometry.spec.core.times import Times, Widths
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.core.words import Words
from tachometry.spec.formats.reciprocal import Reciprocal
from tachometry.spec.language.option import option
from tachometry.spec.language.units import plural, signed_width


@dataclass(frozen=True)
class MForm:
    """Numbers of the datapath of the M method."""

    asked: Asked
    tick: Tick
    velocity: Velocity
    average: int  # n, ticks that are averaged

    @property
    def max_sum(self) -> int:
        """Largest |Σ m_e| of n ticks."""
        return self.average * self.tick.max_count

    @property
    def sum_width(self) -> int:
        """Bits of the sum, signed."""
        return signed_width(self.max_sum)

    @property
    def shift(self) -> int | None:
        """The left shift of the sum, where n is a power of two of at most 2^frac_bits; else None."""
        average, frac_bits = self.average, self.velocity.native_frac_bits
        halvings = average.bit_length() - 1
        exact = average == 1 << halvings and halvings + self.velocity.bound.error_bits <= frac_bits
        return frac_bits - halvings if exact else None

    @property
    def reciprocal(self) -> Reciprocal:
        """The reciprocal 1/n, where a shift is not enough."""
        frac_bits, error_bits = self.velocity.native_frac_bits, self.velocity.bound.error_bits
        return Reciprocal(self.average, self.max_numerator, frac_bits, error_bits, self.asked.bounds)

    @property
    def margin(self) -> int:
        """How far the sum is off for the bounds, in 2^−error_bits counts."""
        return int(self.velocity.bound.uncertainty * (1 << self.velocity.bound.error_bits))

    @property
    def max_numerator(self) -> int:
        """Largest |N| that is multiplied by the reciprocal, in 2^−error_bits counts."""
        return (self.max_sum << self.velocity.bound.error_bits) + self.asked.bounds * self.margin

    @property
    def numerator_width(self) -> int:
        """Bits of the number that is multiplied by the reciprocal, signed."""
        return signed_width(self.max_numerator)

    @property
    def serial(self) -> bool:
        """Whether the sum is multiplied by the reciprocal step by step, between two ticks."""
        return self.shift is None and self.reciprocal.digits + 1 <= self.tick.room

    @property
    def clocks(self) -> int:
        """Clocks from `tick` to the native velocity."""
        if self.shift is not None:
            return 1
        # One clock for the sum, one to load it, one for each addition, one for the result.
        return 3 + (self.reciprocal.digits if self.serial else self.numerator_width)


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
    facts = Facts(
        title="M",
        summary="counts the pulses of one tick, or of several",
        update_by="tick",
        interval="the number of averaged ticks",
        forced="Never high: every tick has its update.",
        takes_reads=True,
    )

    @cached_property
    def form(self) -> MForm:
        """Numbers of the datapath."""
        return MForm(self, self.tick, self.velocity, self.average)

    @cached_property
    def latency(self) -> Latency:
        clocks = self.form.clocks
        return Latency(self, self.velocity, self.tick.room, datapath=clocks, busy=clocks if self.form.serial else 0)

    @cached_property
    def times(self) -> Times:
        return replace(super().times, standstill_ticks=self.average)

    @cached_property
    def widths(self) -> Widths:
        return replace(super().widths, interval=self.average.bit_length())

    @property
    def remembered(self) -> int:
        # After an upset the place in the memory may have to begin anew.
        return (self.average + 1) * self.tick.longest

    @cached_property
    def words(self) -> Words:
        return replace(super().words, description=f"eq. (6), mean of {plural(self.average, 'tick')}")
