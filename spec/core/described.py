"""A spec as files have it: its options as texts and in canonical form."""

from typing import Any

from tachometry.spec.core.core import Core
from tachometry.spec.language.option import options_of
from tachometry.spec.language.units import written_time

CHOSEN = "method-chosen"  # what `options_as_asked` call why a method was taken


def options_as_asked(spec: Core) -> dict[str, str]:
    """Return texts of all options that are asked for, by their names."""
    found = {"method": spec.method} | ({CHOSEN: spec.chosen} if spec.chosen else {})
    for part in (spec.encoder, spec.timing, spec):
        found |= written(part, spec)
    return found


def parameters_of(spec: Core) -> dict[str, Any]:
    """Return every option in canonical form, defaults and what follows included."""
    found: dict[str, Any] = {"method": spec.method}
    for part in (spec.encoder, spec.timing, spec):
        for about in options_of(type(part)):
            value = about.value_in(part)
            if not (about.tacit and value == about.default):
                found[about.field] = about.canonical(value)
    del found["external_tick"]
    return found | {
        "frac_bits": spec.velocity.frac_bits,
        "velocity_width": spec.velocity.width,
        "max_tick_cycles": spec.tick.longest if spec.external_tick else None,
        "edge_error": float(spec.bound.edge_error) if spec.facts.bounds else found["edge_error"],
    }


def written(part: Any, spec: Core) -> dict[str, str]:
    """Return the options that a part of a core, or the core itself, has beyond defaults, as texts by their names."""
    fitting = {about.field: about for about in reversed(options_of(type(part))) if about.fits_in(spec)}
    found = {}
    for about in reversed(fitting.values()):
        value = about.value_in(part)
        if value is None or ((about.needs or about.tacit) and value == about.default):
            continue
        clocks = spec.timing.tick_cycles if about.unit == "ticks" else 1
        timed = about.parse_at is not None
        found[about.name] = written_time(value * clocks, spec.timing.clock_hz) if timed else about.written(value)
    return found
