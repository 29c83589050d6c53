"""A spec as files have it: its entries of the manifest, and its options as texts and in canonical form."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tachometry.spec.core.stream import stream_entry
from tachometry.spec.language.option import options_of
from tachometry.spec.language.units import written_time

if TYPE_CHECKING:
    from tachometry.spec.core.tachometer import TachometerSpec

CHOSEN = "method-chosen"  # what `options_as_asked` call why a method was taken


def entries_of(spec: TachometerSpec) -> dict[str, Any]:
    """Return entries of the manifest, beside ports and options."""
    times, scale, frac_bits = spec.times, spec.scale, spec.widths.frac_bits
    found = {
        "method": spec.method,
        "clock_hz": spec.timing.clock_hz,
        "tick_cycles": spec.timing.tick_cycles,
        "max_ticks": spec.timing.max_ticks,
        "stalled_after_ticks": times.stalled_after_ticks,
        "counts_per_rev": spec.encoder.counts_per_rev,
        "decoding": spec.encoder.decoding,
        "velocity": {
            "width": spec.widths.velocity,
            "frac_bits": frac_bits,
            "unit": spec.unit,
            "rad_per_s_per_lsb": scale.rad_per_s_per_lsb,
            "full_scale": scale.full_scale * 2.0**-frac_bits,
            "full_scale_rad_per_s": scale.full_scale * scale.rad_per_s_per_lsb,
        },
        **spec.method_entries,
        "stream": stream_entry(spec),
        "max_time_cycles": times.longest,
        "min_time_cycles": times.shortest,
        "bounds": {"none": spec.bound.shown_absent} if spec.bounds else None,
        "interval_unit_cycles": times.interval_unit,
        "latency_cycles": spec.latency.entries,
        "recovery_cycles": spec.recovery.clocks,
        "external_tick_cycles": (
            {"min": times.min_tick_cycles, "max": times.longest_tick} if spec.external_tick else None
        ),
    }
    return {name: entry for name, entry in found.items() if entry is not None}


def options_as_asked(spec: TachometerSpec) -> dict[str, str]:
    """Return texts of all options that are asked for, by their names."""
    found = {"method": spec.method} | ({CHOSEN: spec.chosen} if spec.chosen else {})
    for part in (spec.encoder, spec.timing, spec):
        found |= written(part, spec)
    return found


def parameters_of(spec: TachometerSpec) -> dict[str, Any]:
    """Return every option in canonical form, defaults and what follows included."""
    found: dict[str, Any] = {"method": spec.method}
    for part in (spec.encoder, spec.timing, spec):
        for about in options_of(type(part)):
            value = getattr(part, about.field)
            if not (about.tacit and value == about.default):
                found[about.field] = about.canonical(value)
    del found["external_tick"]
    return found | {
        "frac_bits": spec.widths.frac_bits,
        "velocity_width": spec.widths.velocity,
        "max_tick_cycles": spec.times.longest_tick if spec.external_tick else None,
        "edge_error": float(spec.bound.edge_error) if spec.facts.bounds else found["edge_error"],
    }


def written(part: Any, spec: TachometerSpec) -> dict[str, str]:
    """Return what is asked for in the fields of a part of a core, or of the core itself, as texts by option names."""
    fitting = {about.field: about for about in reversed(options_of(type(part))) if about.fits_in(spec)}
    found = {}
    for about in reversed(fitting.values()):
        value = getattr(part, about.field)
        if value is None or ((about.needs or about.tacit) and value == about.default):
            continue
        clocks = spec.timing.tick_cycles if about.unit == "ticks" else 1
        timed = about.parse_at is not None
        found[about.name] = written_time(value * clocks, spec.timing.clock_hz) if timed else about.written(value)
    return found
