"""`generate` and `plan` print what a core is, what it measures, and how wide and late its outputs are."""

import math

from tachometry.cli.reports.terminal import print_rows
from tachometry.sim.studies.plan import Plans
from tachometry.spec import TachometerSpec
from tachometry.spec.control import AnySpec
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.language.units import SPEED, SpeedUnit, plural, short_time
from tachometry.spec.registers.loop import registers_of
from tachometry.spec.registers.manifest import manifest
from tachometry.spec.registers.map import WORD


def print_core(spec: TachometerSpec, plans: Plans, bus: str = "none") -> None:
    """Print the configuration of a core, its errors at worst and at the ends, and its registers on a bus."""
    registers = [] if bus == "none" else [registers_row(spec, bus)]
    print_rows([*configuration(spec), *_resolution(spec, plans), *registers])


def configuration(spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return rows of the table: a name and its value."""
    encoder, timing = spec.encoder, spec.timing
    counts = f"{encoder.pulses_per_rev} pulses per revolution x{encoder.decoding}: {encoder.counts_per_rev} counts"
    fastest = spec.scale.greatest_speed
    greatest = f"{speed_text(fastest)} ({fastest / spec.scale.unit_velocity:.6g} counts per tick)"
    latencies = manifest(spec)["latency_cycles"]
    memory = spec.words.memory
    return [
        (
            "method",
            f"{spec.method.upper()}, {f'{spec.chosen}: ' if spec.chosen else ''}{spec.words.description}",
        ),
        ("encoder", counts),
        ("clock", f"{timing.clock_hz:,} Hz"),
        ("tick", f"{short_time(timing.tick_seconds)} ({plural(timing.tick_cycles, 'clock')})"),
        ("maximum time", f"{short_time(timing.max_ticks * timing.tick_seconds)} ({timing.max_ticks} ticks)"),
        ("unit velocity", f"{speed_text(spec.scale.unit_velocity)} (1 count per tick)"),
        ("greatest speed", greatest),
        ("full scale", _full_scale(spec)),
        (
            "one LSB of velocity",
            f"2^{-spec.widths.frac_bits} {spec.unit} = {spec.scale.rad_per_s_per_lsb:.6g} rad/s; rounding adds up to "
            f"{spec.scale.rounding_lsb} of it",
        ),
        ("widths", ", ".join(f"{port.name} {port.width}" for port in spec.ports.outputs if port.width > 1)),
        *([] if memory is None else [("reciprocal", memory_text(*memory))]),
        *([("reciprocal", spec.words.division)] if spec.words.division else []),
        *((name, f"{plural(n, 'clock')} ({short_time(spec.times.seconds(n))})") for name, n in latencies.items()),
        ("standstill", _standstill(spec)),
        *(("note", note) for note in spec.words.notes),
    ]


def choice(spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return the row of a table that says which method was taken, if none was named."""
    return [("method", spec.words.method)] if spec.chosen else []


def full_scale_text(spec: TachometerSpec, full_scale: int) -> str:
    """Return a greatest velocity in LSB, in the unit of a core and in rad/s."""
    value = f"{full_scale * 2.0**-spec.widths.frac_bits:.9g} {spec.unit}"
    if spec.unit == NATIVE:
        value += f" = {full_scale * spec.scale.rad_per_s_per_lsb:.6g} rad/s"
    return f"{value}, either way"


def _full_scale(spec: TachometerSpec) -> str:
    value = full_scale_text(spec, spec.scale.full_scale)
    if not spec.scale.narrow:
        return value
    counted = spec.scale.shown_unit.of(spec.widths.max_velocity * spec.scale.unit_velocity)
    held = f"{value}; that is what {spec.widths.velocity} bits hold"
    return f"{held}, counted is up to {counted:.6g} {spec.scale.shown_unit.name}"


def worst_error(spec: TachometerSpec, plans: Plans) -> list[tuple[str, str]]:
    """Return the row that says how great the error may be at constant speed, and where; none if it is not known."""
    if (worst := plans.worst) is None:
        return []
    unit = typed_unit(spec)
    (speed,), (resolution,), (time,) = worst.speed, worst.resolution, worst.measurement_time
    error = resolution + spec.scale.rounding_lsb * spec.scale.rad_per_s_per_lsb
    at = f"{unit.of(speed):.6g} {unit.name}, measured in {short_time(float(time))}"
    speeds = f"{unit.of(plans.low):.4g} to {unit.of(plans.high):.6g} {unit.name}"
    shown = f"{unit.of(error):.4g} {unit.name} at {at}; at constant speeds from {speeds}, with an ideal disc"
    return [("worst error", shown)]


def typed_unit(spec: TachometerSpec) -> SpeedUnit:
    """Return the unit to show speeds in: that of --unit, else that of --max-speed, else rad/s."""
    if spec.unit == NATIVE and spec.max_speed is not None:
        return SpeedUnit(spec.max_speed.unit)
    return spec.scale.shown_unit


def _resolution(spec: TachometerSpec, plans: Plans) -> list[tuple[str, str]]:
    """Return what the equations of the method promise at the ends of its range."""
    unit, ends = typed_unit(spec), plans.ends
    rows = worst_error(spec, plans)
    columns = zip(("low", "high"), ends.speed, ends.resolution, ends.measurement_time, strict=True)
    for name, speed, resolution, time in columns:
        if math.isnan(resolution):
            shown = "unknown: there are no equations for the method, or it is too fast for it"
        else:
            rounding = spec.scale.rounding_lsb * spec.scale.rad_per_s_per_lsb
            shown = (
                f"{unit.of(resolution):.4g} {unit.name} and {unit.of(rounding):.2g} by rounding, at "
                f"{unit.of(speed):.6g} {unit.name}, measured in {short_time(float(time))}"
            )
        rows.append((f"resolution, {name}", shown))
    return rows


def registers_row(spec: AnySpec, bus: str) -> tuple[str, str]:
    """Tell how many registers a core has on a bus."""
    registers = registers_of(spec)
    number = len(registers.registers)
    return "registers", f"{number} of {WORD} bits on {bus}, configuration 0x{registers.configuration:08x}"


def memory_text(kind: str, entries: int, width: int) -> str:
    """Return a memory, and how many bits it has."""
    return f"{kind}: {entries} x {width} = {entries * width} bits of block RAM"


def _standstill(spec: TachometerSpec) -> str:
    rest = spec.times.standstill_ticks
    time = short_time(rest * spec.timing.tick_seconds)
    return f"reads 0 at most {time} ({plural(rest, 'tick')}) after the last count's tick"


def speed_text(rad_per_s: float) -> str:
    """Return a speed in all units."""
    return " = ".join(f"{SpeedUnit(unit).of(rad_per_s):.6g} {unit}" for unit in SPEED)
