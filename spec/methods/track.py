"""The tracking method: a filter for fluctuating measurement time (Tsuji 2009, eq. (22), Fig. 11), made an observer."""

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

from tachometry.spec.core.facts import Facts
from tachometry.spec.core.follows import Follows
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.words import Words
from tachometry.spec.formats.tracking import Tracking
from tachometry.spec.formats.tracking_program import Program
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.language.option import ParameterError, option
from tachometry.spec.language.port import UPDATE, Port, held
from tachometry.spec.language.units import FRACTION, Quantity, format_time, parse_bandwidth

MOST_WIDTH = 64  # bits of a word
MOST_ACCELERATION_WIDTH = 48
FETCH_CLOCKS = 3  # to fetch the first instruction, to read its word, and to hold both


class Acceleration(Follows["TrackTachometer"]):
    """Finds the format of the acceleration that the tracking method shows."""

    @property
    def _per_count(self) -> Fraction:
        """One count per tick² in the unit."""
        count = self.spec.scale.per_count
        return count if self.spec.unit == NATIVE else count / self.spec.timing.tick_seconds

    @property
    def unit(self) -> str:
        """The unit of the acceleration: that of the velocity per second, or counts per tick²."""
        return {"rad/s": "rad/s²", "rev/s": "rev/s²", "rpm": "rpm/s"}.get(self.spec.unit, "count/tick²")

    @property
    def width(self) -> int:
        """Bits of the acceleration: eight more than the velocity has."""
        return min(self.spec.widths.velocity + 8, MOST_ACCELERATION_WIDTH)

    @property
    def of_form(self) -> Fraction:
        """One LSB of the acceleration of the recursion in the unit."""
        form = self.spec.form
        return self._per_count / form.unit_ticks**2 / (1 << (form.frac_bits + form.extra_bits))

    @cached_property
    def frac_bits(self) -> int:
        """Fraction bits of the acceleration: its error is at most a quarter of an LSB, and the greatest one fits."""
        form, one = self.spec.form, self.of_form
        fitting = math.floor(math.log2(((1 << (self.width - 1)) - 2) / (form.max_acceleration * one)))
        return min(fitting, math.floor(-math.log2(8 * form.acceleration_error * one)))

    @property
    def rad_per_s2_per_lsb(self) -> float:
        """One LSB in rad/s²; ticks are as long as nominal."""
        counts = Fraction(1, 2) ** self.frac_bits / self._per_count
        return self.spec.scale.unit_velocity * float(counts / self.spec.timing.tick_seconds)


class TrackLatency(Latency["TrackTachometer"]):
    """Counts the clocks from a pin to the velocity of a tracking core."""

    @property
    def serial(self) -> bool:
        return True

    @property
    def datapath(self) -> int:
        return self.spec.program.clocks + FETCH_CLOCKS


class TrackRecovery(Recovery["TrackTachometer"]):
    """Says how long a tracking core takes until all is right again after an upset."""

    @property
    def clocks(self) -> None:
        # It forgets gradually, and wholly when the shaft has rested.
        return None


class TrackWords(Words["TrackTachometer"]):
    """Says of a tracking core what commands show."""

    @property
    def description(self) -> str:
        return f"third order, {float(self.spec.bandwidth):.4g} rad/s"

    @property
    def notes(self) -> tuple[str, ...]:
        disc = (
            f"--edge-error {float(self.spec.edge_error):.4g} suits a disc whose (phase error + duty error)/180 °e + "
            f"nonuniformity + 3 x jitter is no more"
        )
        return (*super().notes, disc)


@dataclass(frozen=True, kw_only=True)
class TrackTachometer(TachometerSpec):
    """Tachometer that tracks position, velocity and acceleration with a fading-memory filter of third order.

    It predicts in every tick, and corrects in ticks with counts, with gains for the time since the counts before. The
    velocity is new in every tick; docs/concepts/track.md has the rules.

    Parameters
    ----------
    bandwidth : Fraction
        λ_0 in rad/s: the three poles of the filter while the speed changes.
    least_memory : Fraction
        θ_min at λ_0: the least weight of the past when a count comes, however late.
    edge_error : Fraction
        E in counts: a count that is off by more is answered at once, by four times the bandwidth.
    agile : bool
        Whether it is.
    growing_memory : bool
        Whether λ falls to λ_0/10 while the counts come where they are expected.
    fine_bits : int
        Fraction bits of `position_fine`.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    bandwidth: Fraction = option(  # noqa: RUF009
        None,
        "The three poles λ0 of the filter while the speed changes, in rad/s, Hz or kHz: more follows faster, less is "
        "less noisy.",
        text="1000rad/s",
        metavar="BANDWIDTH",
        unit="rad/s",
        parse=parse_bandwidth,
        tests=("", "400", "5kHz"),
    )
    least_memory: Fraction = option(  # noqa: RUF009
        None,
        "The least weight of the past when a count comes, however long after the one before, 0.5 to 0.95.",
        text="0.7",
        metavar="THETA",
        parse=Quantity(FRACTION),
        tests=("", "0.5"),
    )
    edge_error: Fraction = option(  # noqa: RUF009
        None,
        "Counts that are off by more than E, 0.05 to 2 counts, are taken for a change of the speed, and not for an "
        "error of the disc.",
        text="0.4",
        metavar="E",
        parse=Quantity(FRACTION),
        tests=("", "0.7"),
    )
    agile: bool = option(True, "Follow counts that are off by more than --edge-error with four times the bandwidth.")
    growing_memory: bool = option(True, "Let the bandwidth fall to a tenth while the counts come where expected.")
    fine_bits: int = option(6, "Fraction bits of position_fine, 1 to 16.", metavar="N", tests=("", "1", "16"))

    method = "track"
    facts = Facts(
        title="Tracking",
        summary="tracks position, velocity and acceleration",
        update_by="tick",
        own_ticks=False,
        bounds=False,
        last_at_rest=False,
        rest_tenths=17,
        pairs_all=False,
    )
    acceleration = cached_property(Acceleration)
    latency = cached_property(TrackLatency)
    recovery = cached_property(TrackRecovery)
    words = cached_property(TrackWords)

    def __post_init__(self) -> None:
        if not Fraction(1, 2) <= self.least_memory <= Fraction(19, 20):
            raise ParameterError("least_memory", f"must be from 0.5 to 0.95, not {float(self.least_memory):.9g}")
        if not 1 <= self.fine_bits <= 16:
            raise ParameterError("fine_bits", f"must be from 1 to 16, not {self.fine_bits}")
        if not 0 < self.bandwidth <= self.timing.clock_hz:
            raise ParameterError(
                "bandwidth",
                f"must be more than 0 and at most {self.timing.clock_hz} rad/s here, not {float(self.bandwidth):.9g}",
            )
        if not Fraction(1, 20) <= self.edge_error <= 2:
            raise ParameterError("edge_error", f"must be from 0.05 to 2, not {float(self.edge_error):.9g}")
        super().__post_init__()
        if self.bounds:
            raise ParameterError("bounds", f"must not be given with method {self.method}: no window encloses its speed")
        if self.form.width > MOST_WIDTH:
            raise ParameterError(
                "method",
                f"must not be {self.method} here: its words would have {self.form.width} bits, and {MOST_WIDTH} are "
                "the most; a shorter max_time or tick, a lower max_speed, fewer frac_bits or another bandwidth helps",
            )
        shortest = self.times.min_tick_cycles
        if self.timing.tick_cycles < shortest:
            raise ParameterError(
                "tick_cycles",
                f"must be at least {shortest} ({format_time(self.times.seconds(shortest))}) with method {self.method} "
                f"here, not {self.timing.tick_cycles}",
            )

    @cached_property
    def form(self) -> Tracking:
        """Formats and constants of the recursion."""
        return Tracking(
            clock_hz=self.timing.clock_hz,
            tick_cycles=self.timing.tick_cycles,
            longest_tick=self.times.longest_tick,
            max_ticks=self.timing.max_ticks,
            max_count=self.widths.max_count,
            external=self.external_tick,
            bandwidth=self.bandwidth,
            least_memory=self.least_memory,
            edge_error=self.edge_error,
            agile=self.agile,
            growing=self.growing_memory,
            velocity_bits=self.widths.native_frac_bits,
            fine_bits=self.fine_bits,
        )

    @cached_property
    def program(self) -> Program:
        """The program of the datapath from a tick to the update."""
        form = self.form
        latency, acceleration = self.latency, self.acceleration
        delay = latency.pin_to_count + latency.tick + FETCH_CLOCKS + latency.low_pass + latency.output
        return Program(form, Fraction(2) ** acceleration.frac_bits * acceleration.of_form, delay)

    @property
    def method_ports(self) -> tuple[Port, ...]:
        return (
            held(
                *(UPDATE, "acceleration", self.acceleration.width),
                signed=True,
                unit=f"2^{-self.acceleration.frac_bits} {self.acceleration.unit}",
                help="Acceleration; multiplied by rad_per_s2_per_lsb of the manifest it is in rad/s².",
            ),
            held(
                *(UPDATE, "position_fine", self.position_width + self.fine_bits),
                signed=True,
                unit=f"2^{-self.fine_bits} counts",
                help="Position at the end of this period, between the counts as well; it wraps as position does.",
            ),
        )

    @property
    def method_entries(self) -> dict[str, dict[str, Any]]:
        return {
            "acceleration": {
                "width": self.acceleration.width,
                "frac_bits": self.acceleration.frac_bits,
                "unit": self.acceleration.unit,
                "rad_per_s2_per_lsb": self.acceleration.rad_per_s2_per_lsb,
            },
            "position_fine": {"frac_bits": self.fine_bits},
        }
