"""Parameters that every core has, whatever its method."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tachometry.spec.core.encoder import Encoder
from tachometry.spec.core.timing import MAX_TICK_CYCLES, Timing, whole_clocks
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, parse_lsb
from tachometry.spec.language.docstrings import with_inherited
from tachometry.spec.language.option import Derived, Option, option, parse_flag, parse_whole
from tachometry.spec.language.units import FRACTION, Speed, parse_bandwidth, read_exactly

# The longest external tick, if nothing else is said.
TWO_TICKS: Any = Derived(lambda spec: min(2 * spec.timing.tick_cycles, MAX_TICK_CYCLES))


def _clocks(what: str, text: str) -> Derived:
    return Derived(lambda spec: whole_clocks(what, text, spec.timing.clock_hz))


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """Parameters of a core.

    Parameters
    ----------
    encoder : Encoder
    timing : Timing
    unit : str
        Of `velocity`: `count/tick`, `rad/s`, `rev/s` or `rpm`.
    frac_bits : int
        One LSB of `velocity` is 2^−frac_bits of its unit. If it is not given: 16 in counts per tick, else 10; fewer if
        there cannot be as many, or if with `max_speed` the velocity would not fit `velocity_width`.
    velocity_width : int
        Bits of `velocity`. With fewer than it can need, it saturates and raises `velocity_overflow`; `max_speed` must
        fit. If it is not given: as many as it can need.
    max_speed : Speed or None
        Greatest speed to be measured. It narrows every number that depends on it; pulses beyond it saturate m_e and
        raise `overflow`. None: as wide as the tick has clocks.
    position_width : int
        Bits of `position`, which wraps.
    filter_clocks : int
        A level is accepted after so many stable clocks, and reported so many clocks late; 0 for no filter.
    index : bool
        A rising index line Z captures the position.
    index_reset : bool
        The rising index line also sets the position to 0.
    max_tick_cycles : int or None
        Ticks come from outside, this many clocks apart at most (`TWO_TICKS`: two nominal ticks); the tick of `timing`
        is their nominal period. None: the core makes the ticks.
    age : bool
        Output `age`: ticks since the update.
    bounds : bool
        Outputs `velocity_lower` and `velocity_upper`, which enclose the true mean speed over the measured window, and
        `bounds_valid`; for a disc and lines whose edges are within `edge_error`, while no count is lost or added.
    edge_error : Fraction
        The distance of any two edges is off by at most so many counts, 0 to 1; it is rounded up to eighths.
    lowpass : Fraction or None
        G of the low-pass filter for fluctuating measurement time, eq. (22) of Tsuji 2009, in rad/s; None: no filter.

    Raises
    ------
    ParameterError
        If a parameter is out of range.
    """

    encoder: Encoder
    timing: Timing = Timing()  # noqa: RUF009
    unit: str = option(
        NATIVE,
        "Unit of the velocity; other than count/tick it costs a constant multiplication, and is off by less than one "
        "LSB.",
        choices=UNITS,
        tests=("", "rpm", "rad/s", "rev/s"),
    )
    frac_bits: int = option(
        Derived(lambda spec: spec.default_frac_bits),
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
    velocity_width: int = option(
        Derived(lambda spec: spec.needed_velocity_width),
        "Bits of the velocity, 8 to 64; a velocity that does not fit saturates and raises velocity_overflow. "
        "--max-speed must fit.",
        shown="as many as it can need",
        metavar="N",
        parse=parse_whole,
        tests=("", "needed - 2", "needed - 0"),
    )
    max_speed: Speed | None = option(  # noqa: RUF009
        None,
        "Greatest speed to be measured, in rad/s, rev/s or rpm; a lower one makes the core smaller. Beyond it (with an "
        "external tick: in the longest) the velocity saturates and raises overflow; the position stays exact.",
        shown="one count per clock",
        metavar="SPEED",
        parse=lambda what, text: Speed.parse(text),
        tests=("", "some counts per tick"),
    )
    position_width: int = option(
        32, "Bits of the position, 8 to 48; it wraps in two's complement.", metavar="N", tests=("8", "", "48")
    )
    filter_clocks: int = option(
        0,
        "Glitch filter: a level is accepted after N stable clocks, 0 to 255, and reported N clocks late. Swallowed "
        "edges are counted.",
        name="filter",
        metavar="N",
        tests=("", "1", "5"),
    )
    index: bool = option(False, "Index line z: its rising edge captures the position in index_position.")
    index_reset: bool = option(False, "The rising edge of z also sets the position to 0 (with --index).", needs="index")
    max_tick_cycles: int | None = option(
        None,
        "A rise of tick_in ends a sampling period, as of a PWM carrier; --tick is its nominal length.",
        name="external-tick",
        group="Timing",
        flag=True,
        parse=lambda what, text: TWO_TICKS if parse_flag(what, text) else None,
        also=(
            Option(
                "Longest external tick: after it the core makes a tick itself and raises tick_error.",
                name="max-tick-period",
                metavar="TIME",
                unit="clocks",
                group="Timing",
                shown="2 --tick",
                parse=_clocks,
                needs="external-tick",
            ),
        ),
    )
    age: bool = option(False, "Output age: ticks since the update.")
    bounds: bool = option(
        False,
        "Outputs velocity_lower and velocity_upper, which enclose the true mean speed over the measured window, and "
        "bounds_valid. They hold for an ideal disc and ideal lines, or within --edge-error, while no count is lost.",
        fits=lambda spec: spec.has_bounds,
    )
    edge_error: Fraction = option(  # noqa: RUF009
        Fraction(0),
        "The distance of any two edges is off by at most E counts, 0 to 1, because of the disc and the lines, so "
        "--bounds are wider. It is rounded up to eighths.",
        shown="0",
        metavar="E",
        parse=lambda what, text: read_exactly(what, text, FRACTION),
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

    def __init_subclass__(cls) -> None:
        cls.__doc__ = with_inherited(cls.__doc__, cls.__base__.__doc__ if cls.__base__ else None)
