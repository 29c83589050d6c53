"""Commands print these lines about a run."""

import math
import sys

import numpy as np
from rich.text import Text

from tachometry.cli.reports.streams import INTERRUPTED
from tachometry.cli.reports.terminal import print_rows, stdout_console
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.recording import Recording
from tachometry.sim.signals.run import Mismatch, Run
from tachometry.sim.signals.tables import held_velocity, velocity_error
from tachometry.spec import TachometerSpec
from tachometry.spec.language.units import format_time, plural


def interrupted(n_clocks: int, wanted: int) -> int:
    """Print that a simulation has been ended early; returns the exit status."""
    print(f"tachometry: interrupted after {n_clocks} of {wanted} clocks", file=sys.stderr)
    return INTERRUPTED


def print_summary(
    spec: TachometerSpec,
    run: Run,
    recording: Recording,
    truth: Encoding | None,
    n_mismatches: int,
    first: list[Mismatch],
    engine: str,
) -> None:
    """Print the table, what the core cannot have seen rightly, and the verdict on stdout."""
    print_rows([("engine", engine), *summary(spec, run, truth, n_mismatches)])
    console = stdout_console()
    for mismatch in first:
        console.print(Text(f"first mismatch in {mismatch}"))
    warnings = _warnings(spec, run, recording, truth)
    print_warnings(warnings)
    console.print(verdict(run, n_mismatches, warned=bool(warnings)))


def print_warnings(warnings: list[str]) -> None:
    """Print what a user must not overlook, a line each, on stdout."""
    for warning in warnings:
        stdout_console().print(Text(f"WARNING: {warning}", style="bold yellow"))


def merged_edges(recording: Recording, clock_hz: int, n_clocks: int) -> list[str]:
    """Return a warning if the clock is too slow for the edges of its first `n_clocks`."""
    merged = recording.n_merged(clock_hz, n_clocks)
    if not merged:
        return []
    return [
        f"{plural(merged, 'edge')} came within one clock of another, which no core can tell apart: "
        "counts and velocity are wrong there; --clock must be faster than the edges"
    ]


def _warnings(spec: TachometerSpec, run: Run, recording: Recording, truth: Encoding | None) -> list[str]:
    """Tell why the core cannot have counted what the shaft did."""
    found = merged_edges(recording, spec.timing.clock_hz, run.n_clocks)
    if truth is None and (together := recording.n_together):
        found.append(
            f"at {plural(together, 'instant')} of the capture both lines change: it was sampled more slowly than the "
            "edges came, or the encoder is at fault; counts and velocity are wrong there"
        )
    if truth is not None and (lost := _difference(spec, run, truth)):
        found.append(f"counts out differ from counts in by {lost:+d}")
    return found


def summary(spec: TachometerSpec, run: Run, truth: Encoding | None, n_mismatches: int) -> list[tuple[str, str]]:
    """Return rows of the table: a name and its value."""
    updates = run.updates
    n_overflows = int(np.count_nonzero(run.ticks.overflow))
    rows = [
        (
            "simulated",
            f"{run.n_clocks} clocks ({format_time(spec.seconds(run.n_clocks))}), {len(run.ticks.clock)} ticks",
        ),
        ("updates", f"{len(updates.clock)} ({np.count_nonzero(updates.forced)} of them forced)"),
        ("mismatches", str(n_mismatches)),
        *_counts(spec, run, truth),
        ("errors flagged", _flagged(run, truth)),
    ]
    if truth is not None and truth.n_lost:
        rows.append(("edges lost", f"{truth.n_lost} (pulses that the encoder missed: {truth.n_lost // 2})"))
    if spec.filter_clocks:
        rows.append(("edges swallowed", f"{run.ticks.swallowed_edges[-1]} (glitch filter)"))
    if spec.index:
        last = f", the last at position {run.index.index_position[-1]}" if len(run.index.clock) else ""
        rows.append(("index", f"{len(run.index.clock)} times{last}"))
    if spec.max_tick_cycles:
        rows.append(("tick errors", f"{len(run.tick_errors)} (external tick too early or missing)"))
    if n_overflows:
        rows.append(("overflow", f"{n_overflows} ticks: faster than --max-speed, velocity saturated"))
    if n_saturated := int(np.count_nonzero(updates.get("velocity_overflow"))):
        rows.append(("velocity overflow", f"{n_saturated} updates: beyond --velocity-width, saturated"))
    return rows + _errors(spec, run, truth) + [("note", note) for note in spec.notes]


def counts_in(spec: TachometerSpec, run: Run, truth: Encoding) -> int:
    """Return counts that the shaft has made up to the pin sample that the last tick can hold."""
    clock = int(run.ticks.clock[-1]) - spec.tick_latency - spec.pin_to_count
    return int(truth.true_position(_sampled(max(clock, 0), spec.timing.clock_hz), spec.encoder.decoding))


def _sampled(clock: int, clock_hz: int) -> float:
    """Return the last instant that `Recording.place` puts at or before clock edge `clock`, in seconds."""
    instant = clock / clock_hz
    while instant * clock_hz > clock:
        instant = math.nextafter(instant, 0)
    while (later := math.nextafter(instant, math.inf)) * clock_hz <= clock:
        instant = later
    return instant


def _counts_out(spec: TachometerSpec, run: Run) -> int:
    # An index that resets the position does not undo what has been counted.
    return int(run.ticks.pulse_count.sum() if spec.index_reset else run.ticks.position[-1])


def _difference(spec: TachometerSpec, run: Run, truth: Encoding) -> int:
    """Return counts out less counts in; the position may have wrapped."""
    half = 1 << (spec.position_width - 1)
    return (_counts_out(spec, run) - counts_in(spec, run, truth) + half) % (2 * half) - half


def _counts(spec: TachometerSpec, run: Run, truth: Encoding | None) -> list[tuple[str, str]]:
    out = str(_counts_out(spec, run))
    if truth is None:
        return [("counts in", "unknown"), ("counts out", out)]
    lost = _difference(spec, run, truth)
    difference = f" ({lost:+d})" if lost else ""
    return [("counts in", str(counts_in(spec, run, truth))), ("counts out", f"{out}{difference}")]


def _flagged(run: Run, truth: Encoding | None) -> str:
    if truth is None:
        return str(len(run.errors))
    hint = "; the others are edges within one clock" if len(run.errors) > truth.n_illegal else ""
    return f"{len(run.errors)} (the encoder made {truth.n_illegal} illegal transitions{hint})"


def _errors(spec: TachometerSpec, run: Run, truth: Encoding | None) -> list[tuple[str, str]]:
    name = "velocity error"
    if truth is None:
        return [(name, "unknown: a capture does not tell the true speed")]
    error, unit = velocity_error(held_velocity(spec, run), truth.true_speed), spec.shown_unit
    if error is None:
        return [(name, "unknown: there was no update")]
    return [
        (f"{name}, RMS", f"{unit.of(error.rms):.6g} {unit.name}"),
        (f"{name}, max", f"{unit.of(error.max):.6g} {unit.name}"),
        (f"{name}, mean", f"{unit.of(error.mean):.6g} {unit.name}"),
        ("", "of the held velocity against the shaft's, at every tick after the first update"),
    ]


def verdict(run: Run, n_mismatches: int, warned: bool) -> Text:
    """Return the last line: whether hardware and golden model agree."""
    if n_mismatches:
        return Text(f"FAIL: hardware and golden model differ in {n_mismatches} values", style="bold red")
    only = "; neither was compared with the shaft: see the warning" if warned else ""
    return Text(
        f"PASS: hardware and golden model agree in every bit of {len(run.updates.clock)} updates "
        f"and {len(run.ticks.clock)} ticks{only}",
        style="bold green",
    )
