"""`generate` and `plan` show what a core is, what it measures, and how wide and late its outputs are."""

import numpy as np

from tachometry.sim.studies.estimate import FAMILIES, SPREAD, Estimate
from tachometry.sim.studies.plan import Plans
from tachometry.sim.theory.performance import REAL_DISC
from tachometry.spec import TachometerSpec
from tachometry.spec.control import AnySpec
from tachometry.spec.core.extras.disc import DiscMap
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.language.field import WORD
from tachometry.spec.language.units import parse_frequency, plural, short_time
from tachometry.spec.registers.buses import Bus, registers_on
from tachometry.spec.registers.manifest import manifest


def core_rows(spec: TachometerSpec, bus: Bus | None = None) -> list[tuple[str, str]]:
    """Return the configuration of a core, what it measures, and its registers on a bus."""
    registers = [] if bus is None else [registers_row(spec, bus)]
    plans = Plans.of(spec)
    return [*configuration(spec), *measured(spec, plans), *advice(plans), *registers]


def configuration(spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return rows of the table: a name and its value."""
    encoder, timing = spec.encoder, spec.timing
    counts = f"{encoder.pulses_per_rev} pulses per revolution x{encoder.decoding}: {encoder.encoder_counts} counts"
    if (sampled := encoder.sampled) is not None:
        turns = f", {sampled.turn_bits} bits of turns" if sampled.turn_bits else ""
        counts = f"read once a tick, {sampled.bits} bits: {encoder.encoder_counts} counts per revolution{turns}"
    if encoder.ratio is not None:
        counts += f", {encoder.ratio} turns for one of the shaft: {encoder.counts_per_rev} counts"
    fastest = spec.velocity.greatest_speed
    per_tick = fastest / spec.scale.unit_velocity
    greatest = f"{speed_text(spec, fastest)} ({per_tick:.6g} count{'s' * (per_tick != 1)} per tick)"
    latencies = manifest(spec)["latency_cycles"]
    memory, rest = spec.words.memory, spec.times.standstill_ticks
    time = short_time(rest * timing.tick_seconds)
    return [
        ("method", f"{spec.method.upper()}, {f'{spec.chosen}: ' if spec.chosen else ''}{spec.words.description}"),
        ("encoder", counts),
        ("clock", f"{timing.clock_hz:,} Hz"),
        ("tick", f"{short_time(timing.tick_seconds)} ({plural(timing.tick_cycles, 'clock')})"),
        ("maximum time", f"{short_time(timing.max_ticks * timing.tick_seconds)} ({timing.max_ticks} ticks)"),
        ("unit velocity", f"{speed_text(spec, spec.scale.unit_velocity)} (1 count per tick)"),
        ("greatest speed", greatest),
        ("full scale", full_scale_text(spec, spec)),
        (
            "one LSB of velocity",
            f"2^{-spec.velocity.frac_bits} {spec.unit} = {speed_text(spec, spec.velocity.rad_per_s_per_lsb)}; "
            f"rounding adds up to {spec.velocity.rounding_lsb} of it",
        ),
        ("widths", ", ".join(f"{port.name} {port.width}" for port in spec.ports.outputs if port.width > 1)),
        *([] if memory is None else [("reciprocal", memory_text(*memory))]),
        *([("reciprocal", spec.words.division)] if spec.words.division else []),
        *((name, f"{plural(n, 'clock')} ({short_time(spec.tick.seconds(n))})") for name, n in latencies.items()),
        ("standstill", f"reads 0 at most {time} ({plural(rest, 'tick')}) after the last count's tick"),
        *(("note", note) for note in spec.words.notes),
    ]


def choice(spec: TachometerSpec) -> list[tuple[str, str]]:
    """Return the row of a table that says which method was taken, if none was named."""
    return [("method", spec.words.method)] if spec.chosen else []


def full_scale_text(spec: TachometerSpec, axis: TachometerSpec) -> str:
    """Return the greatest velocity of a core, or of an axis of it, in its unit, and as a speed if that is none."""
    full_scale = axis.velocity.full_scale
    value = f"{full_scale * 2.0**-spec.velocity.frac_bits:.9g} {spec.unit}"
    if spec.unit == NATIVE:
        value += f" = {speed_text(spec, full_scale * spec.velocity.rad_per_s_per_lsb)}"
    value += ", either way"
    if axis.velocity.narrow:
        counted = speed_text(spec, axis.velocity.max * spec.scale.unit_velocity)
        value += f"; that is what {spec.velocity.width} bits hold, counted is up to {counted}"
        value += "; --max-speed makes an LSB with which it fits" * (spec.max_speed is None)
    return value


def measured(spec: TachometerSpec, plans: Plans, late: str = "") -> list[tuple[str, str]]:
    """Return the rows that say what a core measures: range, worst error and delay; none if it is not known.

    `late` says how late the velocity is if that is not known from the spec of one axis.
    """
    if (worst := plans.worst) is None:
        return []
    low, high = plans.range
    below = "; below, a count may take longer than the maximum time" * (low > plans.low)
    rounding = spec.velocity.rounding_lsb * spec.velocity.rad_per_s_per_lsb
    ideal = float(worst.resolution[0]) + rounding
    error = speed_text(spec, ideal + float(worst.disc[0]), 3)
    at, time = speed_text(spec, float(worst.speed[0]), 4), short_time(float(worst.measurement_time[0]))
    real = [("real disc", f"{_real(spec)}; an ideal one has {speed_text(spec, ideal, 3)} there")]
    of = "with a real disc" if (sampled := spec.encoder.sampled) is None else "from the rounding of positions alone"
    return [
        ("range", f"{speed_text(spec, low, 4)} to {speed_text(spec, high)}{below}"),
        ("worst error", f"{error} at a constant {at}, measured in {time}, {of}"),
        *(real if sampled is None else []),
        ("delay", _delay(spec, plans, late)),
        *((name, text.format(speed=speed_text(spec, high))) for name, text in plans.of_extras),
    ]


def _real(spec: TachometerSpec) -> str:
    mapped = DiscMap.of(spec.extras)
    if mapped is not None and (off := mapped.edges_off(spec)) is not None:
        return f"as mapped, {off:.2g} counts RMS remain"
    uneven, phase = REAL_DISC["nonuniformity"], REAL_DISC["phase_error_deg"]
    return f"{100 * REAL_DISC['jitter']:g} % jitter, edges off by {uneven:g} of their pitch, phase by {phase:g} degrees"


def _delay(spec: TachometerSpec, plans: Plans, late: str) -> str:
    late = late or f"{short_time(spec.tick.seconds(spec.latency.tick_to_velocity))} from tick to velocity"
    if lag := spec.times.filter_lag:
        late += f" and {short_time(lag)} by the low-pass filter"
    if spec.words.on_ramps:
        return late if lag else f"{late}; {spec.words.on_ramps}"
    times = plans.line.measurement_time / 2
    halves = dict.fromkeys(short_time(float(find(times))) for find in (np.nanmin, np.nanmax))
    return f"{late}, and half of the time it is measured in: {' to '.join(halves)}"


def advice(plans: Plans) -> list[tuple[str, str]]:
    """Return the row that names a method that would be much better, or much smaller and as good; none if none is."""
    if (found := plans.advice) is None:
        return []
    gain = found.gain
    if gain >= 2:
        error = f"{float(f'{gain:.1g}'):,.0f} times less error at a constant speed"
    else:
        error = f"{1 / gain:.1f} times the error" if gain < 1 / 1.05 else "no more error"
    more = "more" if found.cells > 0 else "fewer"  # how many depends on other options than the error does
    return [("advice", f"{found.method}: {error}, with {more} cells (--method {found.method})")]


def size_rows(found: Estimate) -> list[tuple[str, str]]:
    """Return rows of the estimated cells and greatest clock, and a warning if the clock of the core is above it."""
    title = FAMILIES[found.family].title
    cells = f"about {found.cells:,}, with {found.flip_flops:,} flip-flops ({title})"
    clock = f"about {found.clock_hz / 1e6:.0f} MHz ({title}); seeds of the router differ by {SPREAD:.0%}"
    rows = [("cells", cells), ("greatest clock", clock)]
    if found.is_too_slow:
        near = found.wanted_hz < found.clock_hz * (1 + SPREAD)
        remedy = "take a lower --clock" + ", or route it with several seeds" * near
        if found.remedy is not None:
            remedy = f"{found.remedy[0]} reaches about {found.remedy[1] / 1e6:.0f} MHz"
        rows.append(("warning", f"--clock {parse_frequency.written(found.wanted_hz)} is above that: {remedy}"))
    return rows


def registers_row(spec: AnySpec, bus: Bus) -> tuple[str, str]:
    """Return how many registers a core has on a bus."""
    registers = registers_on(spec, bus)
    number = len(registers.registers)
    return "registers", f"{number} of {WORD} bits on {bus.name}, configuration 0x{registers.configuration:08x}"


def memory_text(kind: str, entries: int, width: int) -> str:
    """Return a memory, and how many bits it has."""
    return f"{kind}: {entries} x {width} = {entries * width} bits of block RAM"


def speed_text(spec: TachometerSpec, rad_per_s: float, digits: int = 6) -> str:
    """Return a speed in the unit that was typed."""
    unit = spec.scale.shown_unit
    return f"{unit.of(rad_per_s):.{digits}g} {unit.name}"
