"""Options of the core: what all methods share, and what each has of its own."""

import functools
from collections.abc import Callable, Collection
from dataclasses import Field, replace
from typing import Any

import click

from tachometry.cli.options.option import all_of, option
from tachometry.spec import METHODS, Encoder, Speed, TachometerSpec, Timing
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, parse_lsb
from tachometry.spec.option import options_of
from tachometry.spec.timing import MAX_TICK_CYCLES, whole_clocks
from tachometry.spec.units import parse_bandwidth

_ENCODER, _TIMING, _CORE = "Encoder", "Timing", "Core"

_TICK = "20us"

_CORE_OPTIONS = [
    option(
        _ENCODER,
        "--ppr",
        type=int,
        required=True,
        metavar="N",
        help="Pulses per revolution: periods of line A (or B) in one turn, as in the encoder's data sheet.",
    ),
    option(
        _ENCODER,
        "--decoding",
        type=int,
        default=4,
        metavar="[4|2|1]",
        help="Counts per pulse: 4 counts every edge, 2 both edges of A, 1 the edges of A while B is low.",
    ),
    option(
        _TIMING,
        "--clock",
        default="48MHz",
        metavar="FREQUENCY",
        help="Clock of the core, in Hz, kHz, MHz or GHz; a plain number is Hz.",
    ),
    option(
        _TIMING,
        "--tick",
        metavar="TIME",
        help="Sampling period Ts, in s, ms, us or ns, a whole number of clocks; a plain number is clocks. "
        f"[default: {_TICK}]",
    ),
    option(_TIMING, "--dt", metavar="TIME", help="The same with method rairan, whose tick is dt."),
    option(
        _TIMING,
        "--max-time",
        default="10ms",
        metavar="TIME",
        help="Longest measurement: after it an update is forced, so that standstill is seen. "
        "Same units, 2 to 2^20 whole ticks; a plain number is clocks.",
    ),
    option(
        _TIMING,
        "--external-tick",
        is_flag=True,
        help="A rise of tick_in ends a sampling period, as of a PWM carrier; --tick is its nominal length.",
    ),
    option(
        _TIMING,
        "--max-tick-period",
        metavar="TIME",
        help="Longest external tick: after it the core makes one itself and flags tick_error. [default: 2 --tick]",
    ),
    option(
        _CORE,
        "--unit",
        type=click.Choice(UNITS),
        default=NATIVE,
        help="Unit of the velocity; other than count/tick it costs a constant multiplication, and is off by less than "
        "one LSB.",
    ),
    option(
        _CORE,
        "--frac-bits",
        type=int,
        metavar="N",
        help="Fraction bits of the velocity: its LSB is 2^-N of the unit. In count/tick 4 to 24. "
        "[default: 16 in count/tick, else 10 or as many as there can be]",
    ),
    option(_CORE, "--lsb", metavar="2^-N", help="The same in other words."),
    option(
        _CORE,
        "--velocity-width",
        "velocity_bits",
        type=int,
        metavar="N",
        help="Bits of the velocity, 8 to 64; what does not fit saturates, and velocity_overflow is flagged. "
        "[default: as many as it can need]",
    ),
    option(
        _CORE,
        "--max-speed",
        metavar="SPEED",
        help="Greatest speed to be measured, in rad/s, rev/s or rpm: makes the core smaller; "
        "beyond it (with an external tick: in the longest) the velocity saturates and overflow is flagged, the "
        "position stays exact. "
        "[default: one count per clock]",
    ),
    option(
        _CORE,
        "--position-width",
        type=int,
        default=32,
        metavar="N",
        help="Bits of the position, 8 to 48; it wraps in two's complement.",
    ),
    option(
        _CORE,
        "--filter",
        "filter_clocks",
        type=int,
        default=0,
        metavar="N",
        help="Glitch filter: a level counts when it has held for N clocks, 0 to 255; costs N clocks of latency. "
        "What it swallows is counted.",
    ),
    option(_CORE, "--index", is_flag=True, help="Line z: its rising edge captures the position in index_position."),
    option(_CORE, "--index-reset", is_flag=True, help="And sets the position to 0."),
    option(_CORE, "--age", is_flag=True, help="Output age: ticks since the update."),
    option(
        _CORE,
        "--bounds",
        is_flag=True,
        help="Outputs velocity_lower and velocity_upper, which enclose the true mean speed over the measured window, "
        "and bounds_valid.",
    ),
    option(
        _CORE,
        "--lowpass",
        metavar="BANDWIDTH",
        help="Low-pass filter of the velocity for measurements of different length, eq. (22), in rad/s, Hz or kHz.",
    ),
]


_METHOD = option(
    _CORE,
    "--method",
    type=click.Choice(list(METHODS)),
    default="s",
    help="How velocity is measured: s averages in step with the alterations of the pulse number, m counts the "
    "pulses of a tick or some, t takes the time between two counts, mt the time of many (Tsuji 2009); rairan begins "
    "its ticks with a count (Rairán 2013).",
)

# Options that are parameters of the core by the same name.
_PASSED = ("position_width", "filter_clocks", "index", "index_reset", "age", "bounds")


def _max_tick_cycles(timing: Timing, external: bool, period: str | None) -> int | None:
    if not external:
        if period is not None:
            raise ValueError("max_tick_period must be given together with --external-tick")
        return None
    return (
        min(2 * timing.tick_cycles, MAX_TICK_CYCLES)
        if period is None
        else whole_clocks("max_tick_period", period, timing.clock_hz)
    )


def _method_options() -> dict[str, dict[str, Field[Any]]]:
    """Fields that are options of methods: by the option, then by the method."""
    found: dict[str, dict[str, Field[Any]]] = {}
    for method, spec in METHODS.items():
        for item in options_of(spec):
            found.setdefault(item.metadata["option"]["name"] or item.name.replace("_", "-"), {})[method] = item
    return found


def _kind(item: Field[Any]) -> "click.ParamType[Any]":
    """What texts the option of a field takes."""
    if choices := item.metadata["option"]["choices"]:
        return click.Choice(choices)
    return click.BOOL if isinstance(item.default, bool) else click.INT if type(item.default) is int else click.STRING


def _method_option(name: str, items: dict[str, Field[Any]]) -> Callable[[Any], Any]:
    """The option of one or several methods; without a default, so that it is seen where it does not belong."""
    item = next(iter(items.values()))
    about = item.metadata["option"]
    default = item.default
    shown = (name if default else f"no-{name}") if isinstance(default, bool) else default
    help_ = f"{about['help']} [default: {shown}]" if default is not None else about["help"]
    words = [f"--{name}/--no-{name}"] if isinstance(default, bool) else [f"--{name}"]
    more = {} if isinstance(default, bool) else {"type": _kind(item), "metavar": about["metavar"]}
    group = f"Method {' and '.join(items)}"
    return option(group, *words, _argument(name), default=None, help=help_, **more)


def _argument(name: str) -> str:
    """What click calls the value of a method's option."""
    return f"method_{name.replace('-', '_')}"


_METHOD_OPTIONS = _method_options()


def methods_with(name: str) -> Collection[str]:
    """Methods that have an option; none if it is not of methods."""
    return _METHOD_OPTIONS.get(name, {})


def method_options(command: Any) -> Any:
    """Decorator: the options that not all methods have."""
    return all_of([_method_option(*item) for item in _METHOD_OPTIONS.items()], command)


def method_values(method: str, timing: Timing, given: dict[str, Any]) -> dict[str, Any]:
    """Values of the method's fields, of what was given of options, by their names; None stands for what was not."""
    values = {}
    for name, value in given.items():
        if value is None:
            continue
        items = _METHOD_OPTIONS[name]
        if method not in items:
            raise ValueError(f"{name} must not be given with method {method}: it is for {' and '.join(items)}")
        parse = items[method].metadata["option"]["parse"]
        values[items[method].name] = parse(value, timing) if parse else value
    return values


def method_options_of_text(method: str, words: list[str]) -> dict[str, Any]:
    """Options of a method from words such as `average=8` or `cancel=no`, by their names."""
    given: dict[str, Any] = {}
    for word in words:
        name, _, text = word.partition("=")
        item = _METHOD_OPTIONS.get(name, {}).get(method)
        if item is None:
            own = ", ".join(name for name, items in _METHOD_OPTIONS.items() if method in items) or "none"
            raise ValueError(f"options of method {method} must be of {own}, not {name!r}")
        kind = _kind(item)
        try:
            given[name] = kind.convert(text, None, None)
        except click.BadParameter as error:
            raise ValueError(f"{name} of method {method} must be a value of its kind: {error.message}") from None
    return given


def common_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: what all methods share, handed to the command as `make`, which makes a spec of a method.

    `make` takes the method's name and what was given of its options, by their names.
    """

    @functools.wraps(command)
    def build(
        *,
        ppr: int,
        decoding: int,
        clock: str,
        tick: str | None,
        dt: str | None,
        max_time: str,
        unit: str,
        frac_bits: int | None,
        lsb: str | None,
        max_speed: str | None,
        external_tick: bool,
        max_tick_period: str | None,
        velocity_bits: int | None,
        lowpass: str | None,
        **others: Any,
    ) -> Any:
        if dt is not None and tick is not None:
            raise ValueError("dt must not be given together with --tick")
        timing = Timing.parse(clock, dt or tick or _TICK, max_time)
        if frac_bits is not None and lsb is not None:
            raise ValueError("lsb must not be given together with --frac-bits")
        bits = frac_bits if lsb is None else parse_lsb(lsb)
        passed = {name: others.pop(name) for name in _PASSED}

        def make(method: str, given: dict[str, Any]) -> TachometerSpec:
            if dt is not None and not METHODS[method].own_ticks:
                raise ValueError(f"dt must not be given with method {method}, but tick")
            spec = METHODS[method](
                encoder=Encoder(ppr, decoding),
                timing=timing,
                max_speed=None if max_speed is None else Speed.parse(max_speed),
                max_tick_cycles=_max_tick_cycles(timing, external_tick, max_tick_period),
                **passed,
                **method_values(method, timing, given),
            )
            coarsest, finest = spec.frac_bits_range(unit)
            default = 16 if unit == NATIVE else max(coarsest, min(10, finest))
            return replace(
                spec,
                unit=unit,
                frac_bits=default if bits is None else bits,
                velocity_bits=velocity_bits,
                lowpass=None if lowpass is None else parse_bandwidth("lowpass", lowpass),
            )

        return command(make=make, **others)

    return all_of(_CORE_OPTIONS, build)


def core_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: the options of the core, handed to the command as one argument `spec`."""

    @functools.wraps(command)
    def build(*, make: Callable[..., TachometerSpec], **others: Any) -> Any:
        return command(**others)

    return core_and_make_options(build)


def core_and_make_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Decorator: the same, and what makes a spec of another method as `make`, see `common_options`."""

    @functools.wraps(command)
    def build(*, make: Callable[..., TachometerSpec], method: str, **others: Any) -> Any:
        given = {name: others.pop(_argument(name)) for name in _METHOD_OPTIONS}
        return command(spec=make(method, given), make=make, **others)

    return common_options(_METHOD(method_options(build)))
