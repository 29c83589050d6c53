"""Checks of a core: that its numbers are in range, and fit each other."""

import math
from fractions import Fraction

from tachometry.spec.core.core import Core
from tachometry.spec.core.extras.extra import refuse
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.sampled import Sampled
from tachometry.spec.core.timing import MAX_TICK_CYCLES
from tachometry.spec.formats.low_pass import MAX_EXTRA_BITS
from tachometry.spec.formats.velocity_output import NATIVE
from tachometry.spec.language.option import ParameterError, check_options
from tachometry.spec.language.units import PI, format_time, rounded, signed_width

MAX_MODULUS = 1 << 24
_LONGEST_FILTER = Fraction(100, 1000)  # s; reed contacts and relays bounce for tens of ms


def check(spec: Core) -> None:
    """Check what is asked for; ParameterError if a parameter is out of range."""
    check_options(spec)
    if spec.encoder.sampled:
        _check_sampled(spec)
    _check_ticks(spec)
    _check_velocity(spec)
    _check_lines(spec)
    if "z" in spec.encoder.inverted and "z" not in spec.front_end.lines:
        raise ParameterError("invert", "must not have z without --index, which makes the line z")
    if spec.encoder.teeth and spec.bounds:
        raise ParameterError("bounds", "must not be given with --teeth: teeth that are not there have no edges")
    _check_index_state(spec)
    _check_place(spec)
    for extra in spec.extras:
        extra.check(spec)
    if spec.facts.bounds:
        _check_edge_error(spec)
    if spec.lowpass is not None:
        _check_lowpass(spec, spec.lowpass)


def _check_sampled(spec: Core) -> None:
    """Refuse what needs edges."""
    with_it = f"with --sensor {spec.encoder.sensor}"
    if not spec.facts.takes_reads:
        raise ParameterError("method", f"must be track or m {with_it}, not {spec.method}", "needs edges")
    for name, none in {"filter_clocks": 0, "blanking_clocks": 0, "index": None}.items():
        if getattr(spec, name) != none:
            raise ParameterError(name, f"must be left out {with_it}: it is for edges")
    half = 1 << spec.position_width - 1
    if not -half <= (spec.encoder.zero or 0) < half:
        raise ParameterError("zero", f"must be from {-half} to {half - 1}, a position, not {spec.encoder.zero}")
    if (counts := spec.modulus) and counts.denominator > 1:
        raise ParameterError("position_modulo", f"must be whole for an encoder that is read, not {float(counts):.9g}")
    if spec.remainder and spec.timing.tick_cycles < spec.remainder.clocks:
        rest = f"must be at least {spec.remainder.clocks} clocks for position_modulo, not {spec.timing.tick_cycles}"
        raise ParameterError("tick_cycles", rest)
    refuse(spec.extras, "sampled")
    if (reads := spec.reads) is not None:
        least = reads.least_tick
        if spec.timing.tick_cycles < least:
            rest = f"must be at least {least} clocks for a read, {format_time(Fraction(least, spec.timing.clock_hz))}"
            raise ParameterError("tick_cycles", f"{rest}, not {spec.timing.tick_cycles}")
        if not reads.is_exact:
            rest = f"must be nearer to a multiple of {reads.encoder_hz} Hz for tformat, not {spec.timing.clock_hz}"
            raise ParameterError("clock_hz", rest)
    age, most = spec.encoder.sample_age, Sampled.most_age(spec.tick.longest)
    if age is not None and not 0 <= age <= most:
        raise ParameterError("sample_age", f"must be from 0 to {most} clocks, two ticks, not {age}")


def _check_lines(spec: Core) -> None:
    most = max(255, int(spec.timing.clock_hz * _LONGEST_FILTER))
    longest = format_time(Fraction(most) / spec.timing.clock_hz)
    if not 0 <= spec.filter_clocks <= most:
        raise ParameterError("filter_clocks", f"must be from 0 to {most} clocks, {longest}, not {spec.filter_clocks}")
    if (blanked := spec.blanking_clocks) and not 2 <= blanked <= most:
        raise ParameterError("blanking_clocks", f"must be 0 or from 2 to {most} clocks, {longest}, not {blanked}")
    if blanked and spec.max_speed is not None:
        counts = spec.max_speed.counts(spec.encoder.counts_per_rev, spec.tick.seconds(1))
        if counts > (fastest := spec.front_end.blanked_counts):
            shortest = format_time(fastest * blanked / counts / spec.timing.clock_hz)
            raise ParameterError(
                "blanking_clocks", f"must be at most {shortest}, the time between edges of a line at --max-speed"
            )


def _check_index_state(spec: Core) -> None:
    if spec.index is None or spec.index.at is None:
        return
    kind, state = spec.encoder.kind, spec.front_end.index_state
    if state is None:
        return
    if not kind.cycle:
        raise ParameterError("index_at", f"must be edge for {kind.name}, whose levels are no place")
    if spec.encoder.teeth:
        raise ParameterError("index_at", "must be left out with --teeth, whose pattern is the index")
    named = [word[0].lower() for word in spec.index.at.split(",")]
    if named != [*kind.lines] or state not in kind.cycle:
        states = " or ".join(
            ",".join(f"{line.upper()}={level}" for line, level in zip(kind.lines, levels, strict=True))
            for levels in sorted(kind.cycle)
        )
        raise ParameterError("index_at", f"must be edge, {states} for {kind.name}, not {spec.index.at}")


def _check_place(spec: Core) -> None:
    if spec.front_end.wheel is not None and spec.front_end.controls:
        name = OF_CONTROLS[spec.front_end.controls[0]]
        raise ParameterError(name, "must not be given together with --teeth, whose pattern is the index")
    half = 1 << spec.position_width - 1
    if spec.preset is not None and not -half <= spec.preset < half:
        raise ParameterError("preset", f"must be from {-half} to {half - 1}, a position, not {spec.preset}")
    if (counts := spec.modulus) is None:
        return
    if str(spec.position_modulo)[0] == "r" and spec.encoder.ratio is not None and spec.front_end.index_resets:
        raise ParameterError("position_modulo", "must be counts with --ratio and --index-reset: the encoder's index")
    most = MAX_MODULUS if spec.encoder.sampled is None else 999_999_999
    if not 2 <= counts <= most:
        raise ParameterError("position_modulo", f"must be from 2 to {most} counts, not {float(counts):.9g}")


def _check_edge_error(spec: Core) -> None:
    if not 0 <= spec.edge_error <= 1:
        raise ParameterError("edge_error", f"must be from 0 to 1, not {float(spec.edge_error):.9g}")
    if spec.edge_error and not spec.bounds:
        raise ParameterError("edge_error", "must be given together with --bounds")


def _check_lowpass(spec: Core, bandwidth: Fraction) -> None:
    least = 4 / (spec.timing.tick_seconds * (1 << MAX_EXTRA_BITS))
    greatest = 2 * PI * spec.timing.clock_hz  # nothing is faster than the clock
    if bandwidth <= 0 or spec.velocity.low_pass.extra_bits > MAX_EXTRA_BITS or bandwidth > greatest:
        raise ParameterError(
            "lowpass",
            f"must be from {rounded(least, up=True)} to {rounded(greatest, up=False)} rad/s here, "
            f"not {float(bandwidth):.9g} rad/s",
        )


def _check_ticks(spec: Core) -> None:
    if not spec.external_tick:
        if spec.max_tick_cycles is not None:
            raise ParameterError("max_tick_cycles", "must be given together with --external-tick")
        return
    if spec.facts.own_ticks:
        raise ParameterError("method", f"must not be {spec.method} with an external tick: it makes its own ticks")
    shortest = spec.timing.tick_cycles
    if shortest < 2:
        raise ParameterError("tick_cycles", "must be at least 2 with an external tick, not 1")
    if not shortest <= spec.tick.longest <= MAX_TICK_CYCLES:
        raise ParameterError(
            "max_tick_cycles", f"must be from {shortest}, one tick, to {MAX_TICK_CYCLES}, not {spec.max_tick_cycles}"
        )


def _check_velocity(spec: Core) -> None:
    coarsest, finest = spec.velocity.frac_bits_range(spec.unit)
    if coarsest <= spec.velocity.frac_bits <= finest:
        _check_full_scale(spec, coarsest)
        return
    if spec.unit == NATIVE:
        raise ParameterError("frac_bits", f"must be from {coarsest} to {finest}, not {spec.velocity.frac_bits}")
    raise ParameterError(
        "lsb",
        f"must be from 2^{-finest} to 2^{-coarsest} {spec.unit} with this encoder and tick, "
        f"not 2^{-spec.velocity.frac_bits}",
    )


def _check_full_scale(spec: Core, coarsest: int) -> None:
    """Check that a velocity of so many bits shows the greatest speed."""
    if spec.max_speed is None or spec.velocity_width is None:
        return
    counts = spec.max_speed.counts(spec.encoder.counts_per_rev, spec.timing.tick_seconds)
    counts = min(counts, Fraction(spec.velocity.max))
    fitting = spec.velocity.fitting_frac_bits(counts)
    if spec.velocity.frac_bits <= fitting:
        return
    needs = f"to show {spec.max_speed} in {spec.velocity_width} bits"
    if fitting < coarsest:
        width = signed_width(math.ceil(counts * spec.scale.per_count * Fraction(2) ** coarsest))
        raise ParameterError("velocity_width", f"must be at least {width} to show {spec.max_speed} in {spec.unit}")
    if spec.unit == NATIVE:
        raise ParameterError("frac_bits", f"must be at most {fitting} {needs}, not {spec.velocity.frac_bits}")
    raise ParameterError("lsb", f"must be at least 2^{-fitting} {spec.unit} {needs}, not 2^{-spec.velocity.frac_bits}")
