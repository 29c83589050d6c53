"""The tracking method: least squares over a memory that finds its own length (after Tsuji 2009, eq. (22), Fig. 11)."""

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

from tachometry.spec.core.asked import Asked
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.core.tick import Scale
from tachometry.spec.core.timing import Timing, parse_clocks
from tachometry.spec.core.velocity import Velocity
from tachometry.spec.core.words import Words
from tachometry.spec.formats.carrying import Carrying
from tachometry.spec.formats.tracking import MOST_MEMORY, RESULT_BITS, WIDTH, Tracking
from tachometry.spec.formats.tracking_code import SMOOTH, SMOOTH_DELAY_BITS, Program
from tachometry.spec.formats.tracking_sampled import SampledTracking
from tachometry.spec.formats.tracking_units import BLOCK, Serial
from tachometry.spec.formats.velocity_output import NATIVE, VelocityOutput
from tachometry.spec.language.option import ParameterError, option, parse_whole
from tachometry.spec.language.port import UPDATE, WHOLE, Port, held, strobe
from tachometry.spec.language.units import format_time, next_written_time, short_time, written_time

NOISE = Fraction(1, 4 * 20_000)  # rad/s that an LSB has at 2000 counts: a quarter of what is left at constant speed
LOOP_MEMORY = Fraction(3, 5)  # over k_v: the longest memory in a loop
_MAX_TIME = "100ms"  # by default
_MULTIPLIERS = ("auto", "serial", "block")
LEAST_PERIOD = 8  # LSB


def _parse_period(what: str, text: str) -> int:
    if text.lower().endswith(("s", "hz")):
        raise ParameterError(what, f"must be in LSB, not {text!r}: for the time between ticks type --tick {text}")
    return parse_whole(what, text)


@dataclass(frozen=True)
class Acceleration:
    """Format of the acceleration that the tracking method shows."""

    asked: Asked
    scale: Scale
    form_bits: int  # fraction bits of the acceleration of the recursion, in counts per clock²
    shift: int = 0  # s, if a count of the recursion is 2^s of the core

    width = 32

    @property
    def per_count(self) -> Fraction:
        """One count per tick² in the unit."""
        count = self.scale.per_count
        return count if self.asked.unit == NATIVE else count / self.asked.timing.tick_seconds

    @property
    def unit(self) -> str:
        """The unit of the acceleration: that of the velocity per second, or counts per tick²."""
        return {"rad/s": "rad/s²", "rev/s": "rev/s²", "rpm": "rpm/s"}.get(self.asked.unit, "count/tick²")

    @property
    def of_form(self) -> Fraction:
        """One LSB of the acceleration of the recursion in the unit."""
        return self.per_count * self.asked.timing.tick_cycles**2 * (1 << self.shift) / (1 << self.form_bits)

    @cached_property
    def frac_bits(self) -> int:
        """Fraction bits of the acceleration: the greatest one fits, and what an event adds to it before it is held."""
        greatest = (2 ** (WIDTH - 2) + 2**RESULT_BITS) * self.of_form
        return math.floor(math.log2(((1 << (self.width - 1)) - 2) / greatest))

    @property
    def rad_per_s2_per_lsb(self) -> float:
        """One LSB in rad/s²; ticks are as long as nominal."""
        counts = Fraction(1, 2) ** self.frac_bits / self.per_count
        return self.scale.unit_velocity * float(counts / self.asked.timing.tick_seconds)


_MULTIPLIER = """Way in which products are computed. serial takes few cells and a clock for each bit, block a \
multiplier of the FPGA and few clocks. auto is serial where that fits the tick."""
_POSITION_FINE_BITS = "Fraction bits of position_fine, 1 to 16. Some extras need more than 6, and then have them."
_PERIOD = """Period of the interpolation error of an encoder that is read. It is a power of two, in LSB: 128 for 1024 \
periods of 17 bits. The core learns that error, as eight offsets a period."""
_SMOOTH = """Outputs velocity_smooth and smooth_delay. The velocity in the middle of the memory, some ms ago, has a \
quarter of the noise; smooth_delay is how long ago, in clocks. For logs, identification, displays."""


@dataclass(frozen=True, kw_only=True)
class TrackTachometer(TachometerSpec):
    """Tachometer that tracks position, velocity and acceleration by least squares; it has no settings.

    The memory over which it fits a parabola through the counts grows while they come where they are expected, and falls
    when they do not. The velocity is new in every tick; docs/concepts/track.md has the rules.

    It raises ParameterError if a parameter is out of range.
    """

    timing: Timing = Timing.parse(max_time=_MAX_TIME)  # noqa: RUF009
    max_memory: int | None = option(
        None,
        "Longest memory, for use inside a control loop. A change that is not yet seen is followed as by "
        "so short a memory. In s, ms, us or ns.",
        shown="4s; with --loop 0.6/k_v",
        metavar="TIME",
        unit="clocks",
        parse_at=parse_clocks,
        tests=("", "5ms"),
    )
    multiplier: str = option("auto", _MULTIPLIER, choices=_MULTIPLIERS, tests=("", "block"))
    position_fine_bits: int = option(
        None, _POSITION_FINE_BITS, metavar="N", parse=parse_whole, limits=(1, 16), shown="6", tests=("", "1", "16")
    )
    period: int | None = option(
        None, _PERIOD, shown="none is learned", metavar="N", parse=_parse_period, tests=(), tacit=True
    )
    smooth: bool = option(False, _SMOOTH, tacit=True)

    method = "track"
    facts = Facts(
        title="Tracking",
        summary="tracks position, velocity and acceleration",
        update_by="tick",
        interval="ticks since the last one with counts",
        forced="The tick held no count.",
        takes_reads=True,
        bounds=False,
        awaits_count=True,
        rests_with=UPDATE,
        usual={"max-time": _MAX_TIME},
    )

    @cached_property
    def velocity(self) -> Velocity:
        greatest, count = self.tick.max_count, self.scale.per_count * (1 << self._shift)
        lsb = NOISE * 2000 / self.encoder.counts_per_rev / Fraction(self.scale.unit_velocity) * count
        return Velocity(
            self,
            self.scale,
            self.bound,
            greatest,
            most_native_frac_bits=RESULT_BITS - 2 - greatest.bit_length(),
            wished_frac_bits=math.ceil(-math.log2(lsb)),
            more_rounding=0.5,  # what is below an LSB may round up, whatever it is
        )

    @property
    def _shift(self) -> int:
        """Bits of a count that are a fraction of one of the recursion."""
        return self.encoder.sampled.shift if self.encoder.sampled else 0

    @cached_property
    def _recursion(self) -> Tracking:
        """Formats of the recursion, whatever is shown of its acceleration."""
        count, most = 1 << self._shift, self.tick.max_count
        common: dict[str, Any] = dict(
            clock_hz=self.timing.clock_hz,
            tick_cycles=self.timing.tick_cycles,
            longest_tick=self.tick.longest,
            external=self.external_tick,
            max_count=-(-most // count),
            counts_per_rev=self.encoder.counts_per_rev / Fraction(count) if count > 1 else self.encoder.counts_per_rev,
            max_memory=None if self.max_memory is None else Fraction(self.max_memory, self.timing.clock_hz),
            max_time=self.timing.max_ticks * self.timing.tick_cycles,
            velocity_out=self.velocity.native_frac_bits + self._shift,
            slope=Fraction(1, 2),
            velocity_std=self.timing.tick_cycles * self.velocity.lsb_per_count * count,
            std_bits=min(self.velocity.width - 1, RESULT_BITS),
            displacement=self.displacement,
        )
        if (sampled := self.encoder.sampled) is None:
            return Tracking(**common)
        return SampledTracking(
            **common,
            period_bits=(self.period or 1).bit_length() - 1,
            waits=self.encoder.unchecked,
            exchanges=any(extra.exchanges for extra in self.extras),
            shift=self._shift,
            most_moved=most,
            most_age=sampled.most_age(self.tick.longest),
            max_ticks=self.timing.max_ticks,
        )

    @cached_property
    def acceleration(self) -> Acceleration:
        """The format of the acceleration."""
        return Acceleration(self, self.scale, self._recursion.acceleration_bits, self._shift)

    @cached_property
    def form(self) -> Tracking:
        """Formats and constants of the recursion."""
        return replace(self._recursion, slope=self.acceleration.of_form * Fraction(2) ** self.acceleration.frac_bits)

    @cached_property
    def _around(self) -> Latency:
        """Latency without the program."""
        return Latency(self, self.velocity, self.tick.room)

    @cached_property
    def program(self) -> Program:
        """The program of the datapath from a tick to the update."""
        around = self._around
        delay = around.pin_to_count + around.tick + around.low_pass + around.output
        serial = Program(self.form, Serial(self.form).times, delay, self.smooth, self.settles)
        fits = serial.all_clocks <= self.tick.room
        return (
            serial
            if self.multiplier == "serial" or (self.multiplier == "auto" and fits)
            else replace(serial, times=BLOCK)
        )

    @cached_property
    def latency(self) -> Latency:
        program = self.program
        clocks, rest = (program.clocks, 0) if self.whole == UPDATE else (program.velocity_clocks, program.clocks)
        found = replace(self._around, datapath=clocks, rest=rest)
        # An update is shown before the next tick, so its age needs no number.
        return replace(found, busy=max(program.all_clocks, found.tick_to_velocity + found.low_pass))

    @property
    def whole(self) -> str:
        return WHOLE if self.program.times is BLOCK else UPDATE

    @cached_property
    def carrying(self) -> Carrying:
        native, cycles = self.velocity.native_frac_bits, self.timing.tick_cycles
        bits = self.position_fine_bits + 1 + (2 * self.tick.longest).bit_length()
        shift = max(0, bits - (native + cycles.bit_length() - 3))  # an LSB has to be that of four of the velocity
        ratio = Fraction(1 << bits, cycles << native + shift)
        per_clock = VelocityOutput(ratio, self.velocity.max << native + shift, bits + 2)
        latency = self.latency
        late = latency.pin_to_count + latency.tick + latency.native_update + per_clock.serial_latency + 3
        slope = Fraction(1, 2) ** self.acceleration.frac_bits / self.acceleration.per_count / cycles**2
        block = self.program.times is BLOCK
        return Carrying(per_clock, shift, self.position_fine_bits, bits - self.position_fine_bits, late, slope, block)

    @cached_property
    def settles(self) -> bool:
        """Whether `position_fine` goes to the middle of a count in a silence, and does not stay at the edge."""
        return self.encoder.sampled is None and any(extra.settles for extra in self.extras)

    @property
    def remembered(self) -> None:
        # It forgets gradually; what it has learned of the disc, not even when the shaft rests.
        return None

    @cached_property
    def words(self) -> Words:
        words, longest = super().words, self.max_memory
        bound = "" if longest is None else f", memory of at most {format_time(self.tick.seconds(longest))}"
        return replace(
            words,
            description=f"least squares over a memory that finds its own length{bound}",
            heading=f"{words.heading}{bound}",
            on_ramps="it does not lag at constant acceleration",
        )

    @property
    def method_entries(self) -> dict[str, dict[str, Any]]:
        acceleration = {
            "width": self.acceleration.width,
            "frac_bits": self.acceleration.frac_bits,
            "unit": self.acceleration.unit,
            "rad_per_s2_per_lsb": self.acceleration.rad_per_s2_per_lsb,
        }
        return {"acceleration": acceleration, "position_fine": {"frac_bits": self.position_fine_bits}}

    def __post_init__(self) -> None:
        shortest, longest = self.timing.tick_cycles, MOST_MEMORY * self.timing.clock_hz
        if self.max_memory is not None and not shortest <= self.max_memory <= longest:
            least, given = (format_time(self.tick.seconds(clocks)) for clocks in (shortest, self.max_memory))
            raise ParameterError("max_memory", f"must be from {least}, a tick, to {MOST_MEMORY}s, not {given}")
        self._check_period()
        if self.position_fine_bits is None:
            needed = max((extra.least_fine_bits(self) for extra in self.extras), default=0)
            object.__setattr__(self, "position_fine_bits", min(max(6, needed), 16))
        super().__post_init__()
        if self.bounds:
            raise ParameterError("bounds", f"must not be given with method {self.method}: no window encloses its speed")
        shortest = self.times.min_tick_cycles
        if self.timing.tick_cycles < shortest:
            given = written_time(self.timing.tick_cycles, self.timing.clock_hz)
            typed = next_written_time(shortest, self.timing.clock_hz)
            other = "--method m" if self.encoder.sampled else "--method mt"
            other = "--multiplier block" if self.multiplier == "serial" else other
            raise ParameterError(
                "tick",
                f"must be longer for method {self.method}, which takes {short_time(self.tick.seconds(shortest))} at "
                f"{self.timing.clock_hz / 1e6:g} MHz, not {given}: try --tick {typed} or {other}",
                f"needs a tick of {shortest} clocks",
                self,
            )
        most = (self.form.constants["most"] >> self.form.time_bits) // self.timing.tick_cycles
        if self.timing.max_ticks > most:
            typed = self.timing.time_of(most)
            raise ParameterError(
                "max_ticks",
                f"must be from 2 to {most} with method track, not {self.timing.max_ticks}: try --max-time {typed}",
                f"takes at most {most} ticks",
            )

    def _check_period(self) -> None:
        if self.period is None:
            return
        if (sampled := self.encoder.sampled) is None:
            raise ParameterError("period", "must be left out: only positions that are read have a period")
        if not (LEAST_PERIOD <= self.period <= 1 << sampled.bits and self.period.bit_count() == 1):
            rest = f"must be a power of two from {LEAST_PERIOD} to {1 << sampled.bits} LSB, a turn, not {self.period}"
            raise ParameterError("period", rest)

    @property
    def method_ports(self) -> tuple[Port, ...]:
        shown = self.acceleration
        unit = f"2^{-shown.frac_bits} {shown.unit}"
        text = "Acceleration; multiplied by rad_per_s2_per_lsb of the manifest it is in rad/s²."
        acceleration = held(self.whole, "acceleration", shown.width, signed=True, unit=unit, help=text)
        width, unit = self.position_width + self.position_fine_bits, f"2^{-self.position_fine_bits} counts"
        text = "Position at the end of this period, between the counts as well; it wraps as position does."
        position = held(self.whole, "position_fine", width, signed=True, unit=unit, help=text)
        unit = f"2^{-self.velocity.frac_bits} {self.unit}"
        text = "Standard deviation that the velocity is expected to have, by the noise that was seen."
        deviation = held(self.whole, "velocity_std", self.form.std_bits, unit=unit, help=text)
        rest: tuple[Port, ...] = acceleration, position, deviation
        if self.whole != UPDATE:
            text = "One clock for every update, when what follows its velocity is there as well."
            rest = (strobe(WHOLE, text), *rest)
        if not self.smooth:
            return rest
        width = self.velocity.width
        text = "Velocity smooth_delay ago, in the middle of the memory as it was before this period. It is in the "
        text += "format of velocity; 0 while no speed is known."
        smooth = held(UPDATE, SMOOTH[0], width, signed=True, unit=unit, help=text)
        text = "Time from the instant of velocity_smooth to velocity_valid; it stays at its greatest value."
        age = held(UPDATE, SMOOTH[1], SMOOTH_DELAY_BITS, unit=self.clock_unit, help=text)
        return *rest, smooth, age

    @property
    def clock_unit(self) -> str:
        """Unit of times in clocks."""
        return "clocks"


def in_loop(spec: TachometerSpec, velocity_gain: Fraction) -> TachometerSpec:
    """Return the core as a control loop with this gain, in 1/s, needs it: with method track, its memory is bounded."""
    if not isinstance(spec, TrackTachometer) or spec.max_memory is not None:
        return spec
    # A memory that sets itself lets the loop swing just below what it can see.
    memory = min(LOOP_MEMORY / velocity_gain, Fraction(MOST_MEMORY))
    return replace(spec, max_memory=max(math.floor(memory * spec.timing.clock_hz), spec.timing.tick_cycles))
