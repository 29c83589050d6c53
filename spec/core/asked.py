"""Options of the measurement that every method has."""

from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.facts import Facts
from tachometry.spec.core.index import Index
from tachometry.spec.core.sensors import parse_modulo
from tachometry.spec.core.timing import Timing, parse_clocks, parse_filter
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, parse_lsb
from tachometry.spec.language.option import Option, option, parse_whole
from tachometry.spec.language.units import FRACTION, Quantity, Speed, parse_bandwidth, parse_speed


@dataclass(frozen=True, kw_only=True)
class Asked:
    """Options of the measurement, None where nothing is asked for; a method adds its own."""

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

    # Name of the method, and what sets it apart.
    method: ClassVar[str]
    facts: ClassVar[Facts]
