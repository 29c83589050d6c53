"""Options of the measurement that every method has."""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.index import Index
from tachometry.spec.core.reads import Reads
from tachometry.spec.core.sampled import Reach, Remainder
from tachometry.spec.core.sensors import parse_modulo
from tachometry.spec.core.timing import MAX_TICK_CYCLES, Timing, parse_clocks, parse_filter
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, parse_lsb
from tachometry.spec.language.option import Option, option, parse_whole
from tachometry.spec.language.units import FRACTION, Quantity, Speed, parse_bandwidth, parse_speed

_UNIT = """Unit of the velocity. All but count/tick cost a constant multiplication, and the velocity is then off by \
less than one LSB."""
_POSITION_WIDTH = "Bits of the position, 8 to 48; it wraps in two's complement."
_FILTER_CLOCKS = """Glitch filter: a level counts once it has held for TIME. Edges are delayed by TIME, which is at \
most 100 ms. In s, ms, us or ns, rounded up to clocks; a plain number is clocks. Edges that are filtered out are \
counted."""
_PRESET = """Input preset sets the position to N when it rises. No count is lost, and the velocity does not change. \
With --bus, register PRESET begins with N, and CONTROL.preset sets the position as well."""
_POSITION_MODULO = """Output position_modulo, 0 to N-1. N is counts, rev is a revolution, rev/4 an electrical turn of \
4 pole pairs. A preset does not change it, --index-reset makes it 0. It goes on where position wraps. \
If the encoder is read, it begins with the M+B bits of the first good read, and N that is no power of two makes all \
outputs later by up to 72 clocks, see tick_latency of the manifest."""
_EXTERNAL_TICK = "Input tick_in ends a sampling period, as of a PWM carrier. --tick is its nominal length."
_BOUNDS = """Bounds: outputs velocity_lower, velocity_upper, bounds_valid. They enclose the true mean speed over the \
measured window, for an ideal disc and ideal lines, or within --edge-error, while no count is lost."""
_EDGE_ERROR = "Widen --bounds for edges that are off by up to E counts. 0 to 1, rounded up to eighths."
_LOWPASS = """Low-pass filter of the velocity, in rad/s, Hz or kHz. It is for measurements of different length, eq. \
(22); the length is the time since the last update."""
_LSB = "LSB of the velocity: 2^-4 or 0.0625 (instead of --frac-bits). It must be a power of two of the unit."


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Options of the measurement, None where nothing is asked for; a method adds its own."""

    encoder: Encoder
    timing: Timing = Timing.parse()  # noqa: RUF009
    unit: str = option(NATIVE, _UNIT, choices=UNITS, tests=("", "rpm", "rad/s", "rev/s"))
    frac_bits: int | None = option(
        None,
        "Fraction bits of the velocity: its LSB is 2^-N of the unit. 4 to 24 in count/tick.",
        shown="16 in count/tick, else 10; fewer if --max-speed would not fit --velocity-width",
        metavar="N",
        parse=parse_whole,
        tests=("most - 20", "most - 0", "16"),
        also=(Option(_LSB, name="lsb", metavar="2^-N", parse=parse_lsb, tests=()),),
    )
    velocity_width: int | None = option(
        None,
        "Bits of the velocity, 8 to 64. A velocity beyond them saturates and raises velocity_overflow. "
        "--max-speed must fit.",
        shown="as many as it can need",
        metavar="N",
        parse=parse_whole,
        limits=(8, 64),
        tests=("", "needed - 2", "needed - 0"),
    )
    max_speed: Speed | None = option(  # noqa: RUF009
        None,
        "Greatest speed, in rad/s, rev/s or rpm. A lower one makes the core smaller. Above it (with an "
        "external tick: in the longest tick) the velocity saturates and overflow rises; the position "
        "stays exact.",
        shown="one count per clock",
        metavar="SPEED",
        parse=parse_speed,
        tests=("", "some counts per tick"),
    )
    position_width: int = option(32, _POSITION_WIDTH, metavar="N", limits=(8, 48), tests=("8", "", "48"))
    filter_clocks: int = option(
        0, _FILTER_CLOCKS, name="filter", metavar="TIME", shown="0", parse_at=parse_filter, tests=("", "1", "5")
    )
    blanking_clocks: int = option(
        0,
        "Ignore edges of a line for TIME after one that counts. It keeps out echoes and bounce without "
        "delay. In s, ms, us or ns, at most 100 ms, rounded up to clocks; a plain number is clocks. After "
        "it, the line has the level that it then has.",
        name="blanking",
        metavar="TIME",
        shown="0",
        parse_at=parse_filter,
        tests=("", "2", "9"),
        tacit=True,
    )
    index: Index | None = option(  # noqa: RUF009
        None, "Index line z: it captures the position in index_position.", part=Index
    )
    preset: int | None = option(None, _PRESET, metavar="N", parse=parse_whole, tests=("", "-7"), tacit=True)
    position_modulo: str | None = option(
        None, _POSITION_MODULO, metavar="[N|rev|rev/P]", parse=parse_modulo, tests=("", "rev", "7"), tacit=True
    )
    external_tick: bool = option(False, _EXTERNAL_TICK, group="Timing")
    max_tick_cycles: int | None = option(
        None,
        "Longest external tick. After it the core makes a tick itself and raises tick_error.",
        name="max-tick-period",
        metavar="TIME",
        unit="clocks",
        group="Timing",
        shown="2 --tick",
        parse_at=parse_clocks,
        needs="external-tick",
    )
    age: bool = option(False, "Output age: ticks since the update.")
    bounds: bool = option(False, _BOUNDS, fits=lambda spec: spec.facts.bounds)
    edge_error: Fraction = option(  # noqa: RUF009
        Fraction(0), _EDGE_ERROR, shown="0", metavar="E", parse=Quantity(FRACTION), needs="bounds", tests=("0.3",)
    )
    lowpass: Fraction | None = option(  # noqa: RUF009
        None, _LOWPASS, metavar="BANDWIDTH", unit="rad/s", parse=parse_bandwidth, tests=("", "20kHz")
    )

    # Unit that speeds are shown in, of those without a unit of their own; None: that of --max-speed, or rad/s. It is
    # what a motion was typed in, and makes no other core.
    shown: str | None = field(default=None, compare=False, repr=False)

    @cached_property
    def reads(self) -> Reads | None:
        """Reads of the encoder that the core makes; None: it makes none."""
        reads = self.encoder.reads(self.timing.clock_hz)
        return reads and reads.within(self.timing.tick_cycles, self.longest_tick)

    @property
    def longest_tick(self) -> int:
        """Most clocks in a tick; an external one lasts two nominal ones at most, if nothing else was asked for."""
        cycles = self.timing.tick_cycles
        if not self.external_tick:
            return cycles
        return min(2 * cycles, MAX_TICK_CYCLES) if self.max_tick_cycles is None else self.max_tick_cycles

    @cached_property
    def reach(self) -> Reach | None:
        """How far a read may be from the one before, by --max-speed; None: any may be taken."""
        if (sampled := self.encoder.sampled) is None or self.max_speed is None:
            return None
        counts = self.max_speed.counts(self.encoder.counts_per_rev, Fraction(1, self.timing.clock_hz))
        spread = 0 if sampled.age is not None else 2 * self.timing.tick_cycles
        return Reach.of(sampled.width, counts, self.reads.age_spread if self.reads else spread)

    @property
    def modulus(self) -> Fraction | None:
        """Counts within which `position_modulo` is, not always whole; None: there is none."""
        if self.position_modulo is None:
            return None
        of, _, parts = self.position_modulo.partition("/")
        return Fraction(self.encoder.counts_per_rev if of == "rev" else int(of)) / int(parts or 1)

    @property
    def remainder(self) -> Remainder | None:
        """How `position_modulo` of an encoder that is read is found; None: it is bits of the position."""
        number, sampled, most = max(int(self.modulus or 1), 1), self.encoder.sampled, self.position_width
        if sampled is None or (number.bit_count() == 1 and number >> most <= 1):
            return None
        shift = (number & -number).bit_length() - 1
        turns = number >> min(shift, sampled.width)
        width = sampled.width + (turns - 1).bit_length() + 1
        if self.encoder.zero is not None:  # the difference may be half of its range beyond
            width = max(width, most) + 1
        return Remainder(number >> shift, shift, turns, width)

    def read_starts(self, n_clocks: int) -> range:
        """Return the clocks in which reads begin, with ticks that are nominal."""
        assert self.reads is not None
        lead = 0 if self.external_tick else self.reads.longest
        return range(self.timing.tick_cycles - 1 - lead, n_clocks, self.timing.tick_cycles)

    # Name of the method, and what sets it apart.
    method: ClassVar[str]
    facts: ClassVar[Facts]
