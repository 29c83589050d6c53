"""A tachometer says what is asked for: from encoder pins to velocity, whatever the method."""

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

from tachometry.spec.core.bound import Bound
from tachometry.spec.core.checks import check
from tachometry.spec.core.compare import Compare
from tachometry.spec.core.described import options_as_asked, parameters_of
from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.front_end import FrontEnd
from tachometry.spec.core.health import Health
from tachometry.spec.core.index import Index
from tachometry.spec.core.latency import Latency
from tachometry.spec.core.ports import bound_ports, ports_of
from tachometry.spec.core.probe import PROBE_HELP, parse_probes
from tachometry.spec.core.recovery import Recovery
from tachometry.spec.core.scale import Scale
from tachometry.spec.core.sensors import parse_modulo
from tachometry.spec.core.stream import STREAM_HELP, Stream
from tachometry.spec.core.times import Times
from tachometry.spec.core.timing import Timing, parse_clocks, parse_filter
from tachometry.spec.core.widths import Widths
from tachometry.spec.core.words import Words
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, parse_lsb
from tachometry.spec.language.option import Option, option, parse_whole
from tachometry.spec.language.port import Port, Ports
from tachometry.spec.language.units import FRACTION, Quantity, Speed, parse_bandwidth, parse_speed


@dataclass(frozen=True, kw_only=True)
class TachometerSpec:
    """A core of one axis; a method is a subclass, which says what it has of its own.

    Its fields are what is asked for, None where nothing is. What follows from them is in small objects:
    `front_end`, `times`, `widths`, `scale`, `bound`, `latency`, `recovery` and `words`, and `form` has the numbers of
    the method alone. A value out of range raises ParameterError.
    """

    encoder: Encoder
    timing: Timing = Timing.parse()  # noqa: RUF009
    unit: str = option(
        NATIVE,
        "Unit of the velocity; other than count/tick it costs a constant multiplication, and is off by less than one "
        "LSB.",
        choices=UNITS,
        tests=("", "rpm", "rad/s", "rev/s"),
    )
    frac_bits: int | None = option(
        None,
        "Fraction bits of the velocity: its LSB is 2^-N of the unit. In count/tick 4 to 24.",
        shown="16 in count/tick, else 10; fewer if --max-speed would not fit --velocity-width",
        metavar="N",
        parse=parse_whole,
        tests=("most - 20", "most - 0", "16"),
        also=(
            Option(
                "LSB of the velocity as a power of two of its unit: 2^-4 or 0.0625 (instead of --frac-bits).",
                name="lsb",
                metavar="2^-N",
                parse=parse_lsb,
                tests=(),
            ),
        ),
    )
    velocity_width: int | None = option(
        None,
        "Bits of the velocity, 8 to 64; a velocity that does not fit saturates and raises velocity_overflow. "
        "--max-speed must fit.",
        shown="as many as it can need",
        metavar="N",
        parse=parse_whole,
        limits=(8, 64),
        tests=("", "needed - 2", "needed - 0"),
    )
    max_speed: Speed | None = option(  # noqa: RUF009
        None,
        "Greatest speed to be measured, in rad/s, rev/s or rpm; a lower one makes the core smaller. Beyond it (with an "
        "external tick: in the longest) the velocity saturates and raises overflow; the position stays exact.",
        shown="one count per clock",
        metavar="SPEED",
        parse=parse_speed,
        tests=("", "some counts per tick"),
    )
    position_width: int = option(
        32,
        "Bits of the position, 8 to 48; it wraps in two's complement.",
        metavar="N",
        limits=(8, 48),
        tests=("8", "", "48"),
    )
    filter_clocks: int = option(
        0,
        "Glitch filter: a level is accepted when it has held for so long, up to 10 ms, and reported so much late. In "
        "s, ms, us or ns, rounded up to clocks; a plain number is clocks. Swallowed edges are counted.",
        name="filter",
        metavar="TIME",
        shown="0",
        parse_at=parse_filter,
        tests=("", "1", "5"),
    )
    index: Index | None = option(  # noqa: RUF009
        None, "Index line z: the index captures the position in index_position.", part=Index
    )
    preset: int | None = option(
        None,
        "Input preset sets the position to N when it rises; no count is lost, and the velocity does not change. "
        "With --bus, N is what register PRESET begins with, and CONTROL.preset sets the position as well.",
        metavar="N",
        parse=parse_whole,
        tests=("", "-7"),
        tacit=True,
    )
    position_modulo: str | None = option(
        None,
        "Output position_modulo, 0 to N-1: the position of the shaft within N counts, within rev (a revolution), or "
        "within rev/4, an electrical angle of 4 pole pairs. A preset leaves it as it is, --index-reset makes it 0.",
        metavar="[N|rev|rev/P]",
        parse=parse_modulo,
        tests=("", "rev", "7"),
        tacit=True,
    )
    external_tick: bool = option(
        False,
        "A rise of tick_in ends a sampling period, as of a PWM carrier; --tick is its nominal length.",
        group="Timing",
    )
    max_tick_cycles: int | None = option(
        None,
        "Longest external tick: after it the core makes a tick itself and raises tick_error.",
        name="max-tick-period",
        metavar="TIME",
        unit="clocks",
        group="Timing",
        shown="2 --tick",
        parse_at=parse_clocks,
        needs="external-tick",
    )
    age: bool = option(False, "Output age: ticks since the update.")
    bounds: bool = option(
        False,
        "Outputs velocity_lower and velocity_upper, which enclose the true mean speed over the measured window, and "
        "bounds_valid. They hold for an ideal disc and ideal lines, or within --edge-error, while no count is lost.",
        fits=lambda spec: spec.facts.bounds,
    )
    edge_error: Fraction = option(  # noqa: RUF009
        Fraction(0),
        "The distance of any two edges is off by at most E counts, 0 to 1, because of the disc and the lines, so "
        "--bounds are wider. It is rounded up to eighths.",
        shown="0",
        metavar="E",
        parse=Quantity(FRACTION),
        needs="bounds",
        tests=("0.3",),
    )
    lowpass: Fraction | None = option(  # noqa: RUF009
        None,
        "Low-pass filter of the velocity for measurements of different length, eq. (22), in rad/s, Hz or kHz. The "
        "length is the time since the last update.",
        metavar="BANDWIDTH",
        unit="rad/s",
        parse=parse_bandwidth,
        tests=("", "20kHz"),
    )
    health: Health | None = option(  # noqa: RUF009
        None,
        "Watch the encoder: outputs health (the first fault), faults (how many) and fault (there is one), and with "
        "--index index_error. A reset clears them, and CONTROL.clear.",
        tacit=True,
        part=Health,
    )
    over_speed: Speed | None = option(  # noqa: RUF009
        None,
        "Output over_speed trips at a velocity beyond this, in rad/s, rev/s or rpm, and stays so until a reset or "
        "CONTROL.clear.",
        metavar="SPEED",
        parse=parse_speed,
        tests=("", "30rad/s"),
        tacit=True,
    )
    probe: str = option(
        "", PROBE_HELP, metavar="[N|EDGES]", shown="none", parse=parse_probes, tests=("", "3", "both"), tacit=True
    )
    compare: Compare | None = option(  # noqa: RUF009
        None,
        "Output compare has pulses of WIDTH, a time or clocks, at COUNT positions (0: no end) from START on, STEP "
        "counts apart: 100:100:50:10us. They come while the shaft turns forward; with :backward at the end backward, "
        "and with :both whichever way. list:DEPTH:WIDTH takes positions that a program writes, up to DEPTH ahead. With "
        ":fine behind all that START and STEP may lie between counts, where track says that the shaft is.",
        metavar="[START:STEP:COUNT|list:DEPTH]:WIDTH",
        parse=Compare.parse,
        tests=("", "2:3:0:2clk", "1.5:2.5:0:2clk:fine", "-2:3:40:1clk:backward", "3:4:9:1clk:both", "list:3:2clk"),
        few=3,
        tacit=True,
    )
    stream: Stream | None = option(  # noqa: RUF009
        None,
        STREAM_HELP,
        metavar="axi[:WHEN[:N]]",
        parse=Stream.parse,
        tests=("", "axi:update:3", "axi:edge:2", "axi:tick:1"),
        tacit=True,
    )
    # why this method was taken, where none was named; empty: it was named
    chosen: str = field(default="", compare=False, repr=False)

    # Name of the method, and what sets it apart.
    method: ClassVar[str]
    facts: ClassVar[Facts]
    # How many axes its outputs are of, if they say which.
    axes: ClassVar[None] = None
    # What follows.
    front_end = cached_property(FrontEnd["TachometerSpec"])
    times = cached_property(Times["TachometerSpec"])
    widths = cached_property(Widths["TachometerSpec"])
    scale = cached_property(Scale["TachometerSpec"])
    bound = cached_property(Bound["TachometerSpec"])
    latency = cached_property(Latency["TachometerSpec"])
    recovery = cached_property(Recovery["TachometerSpec"])
    words = cached_property(Words["TachometerSpec"])

    def __post_init__(self) -> None:
        check(self)

    @property
    def tachometer(self) -> "TachometerSpec":
        """The core of one axis that it is."""
        return self

    @property
    def method_ports(self) -> tuple[Port, ...]:
        """Outputs that only this method has; they are new with `velocity_valid`."""
        return ()

    @cached_property
    def ports(self) -> Ports:
        """Ports of the exported core, in order."""
        return Ports(ports_of(self, (*bound_ports(self), *self.method_ports)))

    @property
    def options(self) -> dict[str, str]:
        """Texts of all options that are asked for, by their names; `of_options` makes the core of them again."""
        return options_as_asked(self)

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults and what follows included."""
        return parameters_of(self)
