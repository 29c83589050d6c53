"""`generate` prints these lines of a core of many axes."""

from tachometry.cli.reports.core import configuration, full_scale_text, measured, memory_text, speed_text
from tachometry.sim.studies.plan import Plans
from tachometry.spec import AxesSpec
from tachometry.spec.language.units import plural, short_time
from tachometry.spec.registers.manifest import manifest


def axes_rows(spec: AxesSpec) -> list[tuple[str, str]]:
    """Return the configuration of a core of many axes."""
    alone, axis = spec.tachometer, spec.axis
    greatest = axis.velocity.max * alone.scale.unit_velocity
    latencies, memory = manifest(spec)["latency_cycles"], spec.words.memory
    own = {
        "greatest speed": f"{speed_text(alone, greatest)} ({plural(axis.velocity.max, 'count')} per tick)",
        "full scale": full_scale_text(alone, axis),
        "widths": ", ".join(f"{port.name} {port.width}" for port in axis.ports.outputs if port.width > 1),
        **({"reciprocal": f"{memory_text(*memory)}; there is no time to divide between two axes"} if memory else {}),
        **{name: plural(clocks, "clock") for name, clocks in latencies.items()},
        "tick_to_velocity": "0 clocks: velocity_valid comes together with tick",
    }
    on = f", on {spec.plan.machines} machines" if spec.plan.machines > 1 else ""
    turns = (
        f"{spec.axes}, each looked at every {plural(spec.slots, 'clock')} and computed in "
        f"{plural(spec.turn_cycles, 'clock')} of a tick{on}"
    )
    rows = [(name, own.get(name, value)) for name, value in configuration(alone) if name != "note"]
    late = f"{short_time(spec.tick.seconds(spec.latency.tick))} from the end of a tick to the last axis' velocity"
    rows += measured(alone, Plans.of(alone, greatest), late)
    return [rows[0], ("axes", turns), *rows[1:], *(("note", note) for note in spec.words.notes)]
