"""Entries of the manifest: what a program must know of a core, beside its ports and its options."""

from functools import singledispatch
from typing import Any

from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.control.ports import loop_entries
from tachometry.spec.core.stream import stream_entry
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.methods.axes import AxesSpec


@singledispatch
def entries_of(spec: AnySpec) -> dict[str, Any]:
    """Return entries of the manifest, beside ports and options."""
    raise NotImplementedError


@entries_of.register
def _(spec: TachometerSpec) -> dict[str, Any]:
    times, velocity, frac_bits = spec.times, spec.velocity, spec.velocity.frac_bits
    found = {
        "method": spec.method,
        "clock_hz": spec.timing.clock_hz,
        "tick_cycles": spec.timing.tick_cycles,
        "max_ticks": spec.timing.max_ticks,
        "stalled_after_ticks": times.stalled_after_ticks,
        "counts_per_rev": spec.encoder.counts_per_rev,
        "decoding": spec.encoder.decoding,
        "velocity": {
            "width": spec.velocity.width,
            "frac_bits": frac_bits,
            "unit": spec.unit,
            "rad_per_s_per_lsb": velocity.rad_per_s_per_lsb,
            "full_scale": velocity.full_scale * 2.0**-frac_bits,
            "full_scale_rad_per_s": velocity.full_scale * velocity.rad_per_s_per_lsb,
        },
        **spec.method_entries,
        "stream": stream_entry(spec.stream, spec, spec.ports) if spec.stream else None,
        "max_time_cycles": times.longest,
        "min_time_cycles": times.shortest,
        "bounds": {"none": spec.velocity.shown_absent} if spec.bounds else None,
        "interval_unit_cycles": times.interval_unit,
        "latency_cycles": spec.latency_entries,
        "recovery_cycles": spec.recovery.clocks,
        "external_tick_cycles": (
            {"min": times.min_tick_cycles, "max": spec.tick.longest} if spec.external_tick else None
        ),
    }
    return {name: entry for name, entry in found.items() if entry is not None}


@entries_of.register
def _(spec: AxesSpec) -> dict[str, Any]:
    alone, axis = spec.tachometer, spec.axis
    of_one, times = entries_of(alone), axis.times
    external = {"min": times.min_tick_cycles * spec.slots, "max": axis.tick.longest * spec.slots}
    of_velocity = {
        "width": axis.velocity.width,
        "full_scale": axis.velocity.full_scale * 2.0**-axis.velocity.frac_bits,
        "full_scale_rad_per_s": axis.velocity.full_scale * axis.velocity.rad_per_s_per_lsb,
    }
    return of_one | {
        "velocity": of_one["velocity"] | of_velocity,
        **axis.method_entries,
        **({} if spec.recovery.clocks is None else {"recovery_cycles": spec.recovery.clocks}),
        **({"external_tick_cycles": external} if alone.external_tick else {}),
        "axes": {
            "axes": spec.axes,
            "parallel": spec.parallel,
            "round_cycles": spec.slots,
            "turn_cycles": spec.turn_cycles,
            "machines": spec.plan.machines,
            "first_tick": spec.tick_clock(0, 0),
        },
        "latency_cycles": spec.latency_entries,
    }


@entries_of.register
def _(spec: LoopSpec) -> dict[str, Any]:
    of_tachometer = entries_of(spec.tachometer)
    of_tachometer.pop("recovery_cycles", None)  # a loop forgets gradually
    return of_tachometer | {"loop": loop_entries(spec)}
