"""`simulate` and `replay` print these lines of a run."""

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.text import Text

from tachometry.cli.reports.capture import axis_warnings, capture_rows, channels, index_distance
from tachometry.cli.reports.core import choice
from tachometry.cli.reports.standard_streams import INTERRUPTED, printable
from tachometry.cli.reports.terminal import print_rows, stdout_console
from tachometry.sim.studies.simulation import Axis, Simulation
from tachometry.spec import CoreSpec
from tachometry.spec.language.port import MISSED, TICK, UPDATE, WIDE
from tachometry.spec.language.units import format_time, plural

_Row = tuple[str, str]  # a name and its value


def print_simulation(simulation: Simulation, kept: Sequence[Path] = ()) -> int:
    """Print the simulation, what the core cannot have seen rightly, and the verdict; return the exit status.

    `kept` are the files of an interrupted one.
    """
    lockstep, spec, axes = simulation.lockstep, simulation.spec, simulation.axes
    run = lockstep.actual
    time, n_ticks = format_time(spec.tick.seconds(run.n_clocks)), simulation.tally.rows[TICK] // len(axes)
    simulated = ("simulated", f"{run.n_clocks} clocks ({time}), {n_ticks} ticks")
    rows, warnings = _summary(spec, axes, ("mismatches", str(lockstep.n_mismatches)))
    print_rows([*choice(spec.tachometer), ("engine", simulation.engine), simulated, *rows])
    console = stdout_console()
    for mismatch in lockstep.first:
        console.print(Text(f"first mismatch in {mismatch}"))
    print_warnings(warnings)
    console.print(_verdict(simulation, warned=bool(warnings)))
    if lockstep.n_mismatches:
        return 1
    if not simulation.interrupted:
        return 0
    where = f", kept in {', '.join(map(str, kept))}" if kept else ""
    of = f" of {simulation.wanted}" if simulation.wanted else ""
    how_far = f"interrupted after {run.n_clocks}{of} clocks{where}"
    print(f"tachometry: {printable(how_far)}", file=sys.stderr)
    return INTERRUPTED


def _summary(spec: CoreSpec, axes: Sequence[Axis], mismatches: _Row) -> tuple[list[_Row], list[str]]:
    """Return rows of the table of a core, and warnings."""
    if spec.axes is None:
        (axis,) = axes
        forced = axis.tally.not_zero[UPDATE, "forced"]
        updates = "updates", f"{axis.tally.rows[UPDATE]} ({forced} of them forced)"
        return [*capture_rows(axis), updates, mismatches, *_rows(axis)], _warnings(axis)
    warnings = [
        f"axis {number}: {plural(axis.n_merged, 'edge')} came within {spec.slots} clocks of another, in which an axis "
        "is looked at once: counts and velocity are wrong there"
        for number, axis in enumerate(axes)
        if axis.n_merged
    ]
    warnings += [f"axis {number}: {warning}" for number, axis in enumerate(axes) for warning in _of_capture(axis)]
    rows = [mismatches, *((f"axis {number}", _line(axis)) for number, axis in enumerate(axes))]
    sources = [(number, source) for number, axis in enumerate(axes) if (source := axis.recording.source)]
    return rows + [("note", f"axis {number}: {note}") for number, source in sources for note in source.notes], warnings


def print_warnings(warnings: list[str]) -> None:
    """Print what a user must not overlook, a line each, on stdout."""
    for warning in warnings:
        stdout_console().print(Text(f"WARNING: {warning}", style="bold yellow"))


def merged_edges(n_merged: int) -> list[str]:
    """Return a warning if the clock is too slow for so many edges."""
    if not n_merged:
        return []
    return [
        f"{plural(n_merged, 'edge')} came within one clock of another, which no core can tell apart: "
        "counts and velocity are wrong there; --clock must be faster than the edges"
    ]


def _warnings(axis: Axis) -> list[str]:
    """Return why the core cannot have counted what the shaft did."""
    warnings = merged_edges(axis.n_merged) + _of_capture(axis)
    if axis.difference:
        warnings.append(f"counts out differ from counts in by {axis.difference:+d}")
    return warnings


def _of_capture(axis: Axis) -> list[str]:
    return [] if axis.truth else axis_warnings(axis)


def _index(axis: Axis) -> str:
    """Return how often the index came, where, and what was wrong with it."""
    rows, places = axis.tally.rows, np.concatenate(axis.tally.places)
    last = f", the last at position {places[-1]}" if len(places) else ""
    wrong = {WIDE: "wider than a period", MISSED: "passed by without the state of --index-at"}
    more = "".join(f"; {text} {rows[name]} times" for name, text in wrong.items() if rows[name])
    return f"{len(places)} times{last}{index_distance(axis)}{more}"


def _rows(axis: Axis) -> list[tuple[str, str]]:
    """Return rows of the table of a core of one axis: a name and its value."""
    spec, run, truth = axis.spec, axis.run, axis.truth
    difference = f" ({axis.difference:+d})" if axis.difference else ""
    rows = [
        ("counts in", "unknown" if axis.counts_in is None else str(axis.counts_in)),
        ("counts out", f"{axis.counts_out}{difference}"),
        ("errors flagged", _flagged(axis)),
    ]
    if truth is not None and truth.n_lost:
        rows.append(("edges lost", f"{truth.n_lost} (pulses that the encoder missed: {truth.n_lost // 2})"))
    if truth is not None and axis.recording.source is None and (jumps := truth.motion.jumps):
        time, jump = max(jumps, key=lambda one: abs(one[1]))
        unit, times = spec.scale.shown_unit, plural(len(jumps), "time")
        rows.append(("note", f"the speed jumps {times}, most by {unit.of(jump):.6g} {unit.name} at {time:.6g} s"))
    if spec.filter_clocks:
        rows.append(("edges filtered", f"{run.ticks.filtered_edges[-1]} (glitch filter)"))
    if spec.index:
        rows.append(("index", _index(axis)))
    if spec.front_end.wheel is not None:
        synced = np.flatnonzero(run.ticks.synced)
        when = format_time(spec.tick.seconds(int(run.ticks.clock[synced[0]]))) if len(synced) else ""
        lost = "" if run.ticks.synced[-1] or not when else ", and lost"
        what = "gap of the wheel" if spec.front_end.wheel.gaps else "extra tooth"
        rows.append((what, f"found within {when}{lost}" if when else "not found"))
    if spec.front_end.index_once:
        rows.append(("homed", "yes" if run.ticks.homed[-1] else "no"))
    if spec.preset is not None:
        rows.append(("position", f"{run.ticks.position[-1]} at the end; counts out are without presets"))
    if spec.modulus is not None:
        rows.append(("position modulo", f"{run.ticks.position_modulo[-1]} of {spec.modulus} at the end"))
    rows += filter(None, (extra.row(spec, run) for extra in spec.extras))
    if spec.external_tick:
        rows.append(("tick errors", f"{len(run.tick_errors)} (external tick too early or missing)"))
    if n_overflows := axis.tally.not_zero[TICK, "overflow"]:
        rows.append(("overflow", f"{n_overflows} ticks: faster than --max-speed, velocity saturated"))
    if n_saturated := axis.tally.not_zero[UPDATE, "velocity_overflow"]:
        rows.append(("velocity overflow", f"{n_saturated} updates: beyond --velocity-width, saturated"))
    return rows + _errors(axis) + [("note", note) for note in spec.words.notes]


def _flagged(axis: Axis) -> str:
    flagged, truth = axis.tally.rows["decode_error"], axis.truth
    if truth is None:
        return str(flagged)
    if axis.spec.encoder.sampled is not None:
        return f"{flagged} (reads that were wrong)"
    hint = "; the others are edges within one clock" if flagged > truth.n_illegal else ""
    return f"{flagged} (the encoder made {truth.n_illegal} illegal transitions{hint})"


def _errors(axis: Axis) -> list[tuple[str, str]]:
    name, error, unit = "velocity error", axis.error, axis.spec.scale.shown_unit
    if axis.truth is None:
        return [(name, "unknown: a capture does not have the true speed")]
    if error is None:
        return [(name, "unknown: there was no update")]
    return [
        (f"{name}, RMS", f"{unit.of(error.rms):.6g} {unit.name}"),
        (f"{name}, max", f"{unit.of(error.max):.6g} {unit.name}"),
        (f"{name}, mean", f"{unit.of(error.mean):.6g} {unit.name}"),
        ("", "of the held velocity against the shaft's, at every tick after the first update"),
    ]


def _line(axis: Axis) -> str:
    """Return the line of one of many axes."""
    run, unit = axis.run, axis.spec.scale.shown_unit
    parts = [f"{plural(len(run.updates), 'update')} ({np.count_nonzero(run.updates.forced)} forced)"]
    if source := axis.recording.source:
        parts.insert(0, channels(source))
    if axis.counts_in is not None:
        parts.append(f"counts in {axis.counts_in}")
    parts += [f"counts out {axis.counts_out}", f"{plural(len(run.errors), 'error')} flagged"]
    if axis.spec.index:
        parts.append(f"index {len(run.index)} times{index_distance(axis)}")
    if (error := axis.error) is not None:
        parts.append(f"velocity error RMS {unit.of(error.rms):.4g}, max {unit.of(error.max):.4g} {unit.name}")
    return ", ".join(parts)


def _verdict(simulation: Simulation, warned: bool) -> Text:
    """Return the last line: whether hardware and golden model agree, and what that says nothing of."""
    tally, n_mismatches = simulation.tally, simulation.lockstep.n_mismatches
    if n_mismatches:
        return Text(f"FAIL: hardware and golden model differ in {n_mismatches} values", style="bold red")
    captured = any(axis.truth is None for axis in simulation.axes)
    of = f" ({plural(tally.n_values, 'value')}); wiring and pulses per turn are not checked" if captured else ""
    only = "; neither was compared with the shaft: see the warning" if warned else ""
    verdict, style = ("INTERRUPTED", "bold yellow") if simulation.interrupted else ("PASS", "bold green")
    if not any(axis.recording.n_changes for axis in simulation.axes):
        verdict, style = "NO EDGE", "bold yellow"
    return Text(
        f"{verdict}: hardware and golden model agree in every bit of {tally.rows[UPDATE]} updates "
        f"and {tally.rows[TICK]} ticks{of}{only}",
        style=style,
    )
