"""Commands print these lines of a core of many axes."""

from collections.abc import Sequence

import numpy as np
from rich.text import Text

from tachometry.cli.reports.core import configuration, full_scale_text, memory_text, speed_text
from tachometry.cli.reports.run import print_warnings, verdict
from tachometry.cli.reports.terminal import print_rows, stdout_console
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.axes import of_axis
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.run import Run
from tachometry.sim.signals.tables import held_from, velocity_error
from tachometry.sim.studies.lockstep import Lockstep
from tachometry.spec import AxesSpec
from tachometry.spec.language.units import format_time, plural
from tachometry.spec.registers.manifest import manifest


def print_axes_core(spec: AxesSpec) -> None:
    """Print the configuration of a core of many axes."""
    alone, axis = spec.tachometer, spec.axis
    greatest = axis.max_velocity * alone.unit_velocity
    latencies = manifest(spec)["latency_cycles"]
    own = {
        "greatest speed": f"{speed_text(greatest)} ({axis.max_velocity} counts per tick)",
        "full scale": full_scale_text(alone, axis.full_scale),
        "widths": ", ".join(f"{port.name} {port.width}" for port in axis.outputs if port.width > 1),
        "reciprocal": f"{memory_text(*spec.memory)}; there is no time to divide between two axes",
        **{name: plural(clocks, "clock") for name, clocks in latencies.items()},
        "tick_to_velocity": "0 clocks: velocity_valid comes together with tick",
    }
    turns = (
        f"{spec.axes}, each looked at every {plural(spec.slots, 'clock')} and computed in "
        f"{plural(spec.turn_cycles, 'clock')} of a tick"
    )
    rows = [(name, own.get(name, value)) for name, value in configuration(alone) if name != "note"]
    print_rows([rows[0], ("axes", turns), *rows[1:], *(("note", note) for note in spec.notes)])


def print_axes_summary(
    spec: AxesSpec, found: Lockstep, recordings: Sequence[Recording], truths: Sequence[Encoding] | None, engine: str
) -> None:
    """Print what was simulated, a line for every axis, what the core cannot have seen rightly, and the verdict."""
    run = found.actual
    ticks = len(run.ticks) // spec.axes
    rows = [
        ("engine", engine),
        ("simulated", f"{run.n_clocks} clocks ({format_time(spec.seconds(run.n_clocks))}), {ticks} ticks"),
        ("mismatches", str(found.n_mismatches)),
    ]
    warnings = []
    for axis, recording in enumerate(recordings):
        own = of_axis(spec, run, axis)
        rows.append((f"axis {axis}", _of_axis(spec, own, axis, None if truths is None else truths[axis])))
        if merged := recording.n_merged(spec.timing.clock_hz // spec.slots, run.n_clocks // spec.slots):
            warnings.append(
                f"axis {axis}: {plural(merged, 'edge')} came within {spec.slots} clocks of another, in which an axis "
                "is looked at once: counts and velocity are wrong there"
            )
    print_rows(rows)
    console = stdout_console()
    for mismatch in found.first:
        console.print(Text(f"first mismatch in {mismatch}"))
    print_warnings(warnings)
    console.print(verdict(run, found.n_mismatches, warned=bool(warnings)))


def _of_axis(spec: AxesSpec, run: Run, axis: int, truth: Encoding | None) -> str:
    updates, alone = run.updates, spec.tachometer
    position = int(run.ticks.position[-1]) if len(run.ticks) else 0
    said = [
        f"{plural(len(updates), 'update')} ({np.count_nonzero(updates.forced)} forced)",
        f"counts out {position}",
        f"{plural(len(run.errors), 'error')} flagged",
    ]
    if spec.axis.index:
        said.append(f"index {len(run.index)} times")
    if truth is not None and len(run.ticks):
        unit = alone.shown_unit
        error = velocity_error(held_from(run.ticks.clock, updates, alone), truth.true_speed)
        said.insert(1, f"counts in {_counts_in(spec, len(run.ticks), axis, truth)}")
        if error is not None:
            said.append(f"velocity error RMS {unit.of(error.rms):.4g}, max {unit.of(error.max):.4g} {unit.name}")
    return ", ".join(said)


def _counts_in(spec: AxesSpec, ticks: int, axis: int, truth: Encoding) -> int:
    """Return counts that the shaft has made from the first look at an axis to the last one of the last tick."""
    latency = spec.axis.pin_to_count
    clocks = np.array([spec.look(axis, latency), spec.look(axis, ticks * spec.rounds - 1)]) - latency
    first, last = truth.true_position(clocks / spec.timing.clock_hz, spec.axis.encoder.decoding)
    return int(last - first)
