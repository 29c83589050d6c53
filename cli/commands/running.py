"""Both simulate and replay run hardware and golden model, and report."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from tachometry.cli.files import Outputs
from tachometry.cli.reports.axes import print_axes_summary
from tachometry.cli.reports.run import interrupted, print_summary
from tachometry.cli.reports.terminal import clocks_progress
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.engines.pick import pick
from tachometry.sim.signals.axes import AxesTrace, Trace
from tachometry.sim.signals.recording import PinTrace, Recording
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.lockstep import Lockstep, lockstep
from tachometry.spec import AxesSpec, CoreSpec, TachometerSpec
from tachometry.spec.language.units import format_time

Window = Callable[[CoreSpec, int], tuple[int, int]]


def run_and_report(
    spec: TachometerSpec,
    source: str,
    recording: Recording,
    truth: Encoding | None,
    outputs: Outputs,
    engine: str,
    window: Window,
) -> int:
    """Run hardware and golden model, write what is wanted, print the summary; the exit status."""
    trace = PinTrace.of(recording, spec)
    found, used = _played(spec, source, trace, truth, outputs, engine, window)
    print_summary(spec, found.actual, recording, truth, found.n_mismatches, found.first, used)
    return _status(found, trace.n_clocks)


def refuse_plot(targets: Mapping[str, Path]) -> None:
    """Check that no figure is wanted of many axes."""
    if "--plot" in targets:
        raise ValueError("--plot must not be given together with --axes: a figure is of one axis")


def run_axes_and_report(
    spec: AxesSpec,
    source: str,
    recordings: Sequence[Recording],
    truths: Sequence[Encoding] | None,
    outputs: Outputs,
    engine: str,
    window: Window,
) -> int:
    """Return the same for many axes, with a recording, and what the shaft truly did, of each."""
    trace = AxesTrace.placed(recordings, spec)
    found, used = _played(spec, source, trace, None, outputs, engine, window)
    print_axes_summary(spec, found, recordings, truths, used)
    return _status(found, trace.n_clocks)


def _played(
    spec: CoreSpec,
    source: str,
    trace: Trace,
    truth: Encoding | None,
    outputs: Outputs,
    engine: str,
    window: Window,
) -> tuple[Lockstep, str]:
    """Return what came of a trace, and what has simulated it; what is wanted is written."""
    _require_a_tick(spec, source, trace)
    shown, chosen = window(spec, trace.n_clocks), pick(engine)
    with outputs:
        with clocks_progress(trace.n_clocks) as progress:
            vcd, fewest = outputs.get("--vcd"), _least(spec)
            found = lockstep(spec, trace, chosen, vcd=vcd, window=shown, progress=progress, fewest=fewest)
        _write(spec, found.trace, found.actual, truth, outputs)
    missing = " (there is no C++ compiler)" if (engine, chosen.name) == ("auto", "pysim") else ""
    return found, chosen.name + missing


def _status(found: Lockstep, wanted: int) -> int:

    if found.n_mismatches:
        return 1
    done = found.actual.n_clocks
    return interrupted(done, wanted) if done < wanted else 0


def _least(spec: CoreSpec) -> int:
    """Return fewest clocks after which there is something to report."""
    return spec.longest_tick + spec.tick_latency


def _require_a_tick(spec: CoreSpec, source: str, trace: Trace) -> None:
    needed = _least(spec)
    if trace.n_clocks < needed:
        raise ValueError(
            f"{source} must last at least {needed} clocks of --clock ({format_time(spec.seconds(needed))}), "
            f"a tick and its latency, not {trace.n_clocks}"
        )


def _write(spec: CoreSpec, trace: Trace, run: Run, truth: Encoding | None, outputs: Outputs) -> None:
    if path := outputs.get("--trace"):
        from tachometry.sim.signals.tables import write_trace

        write_trace(path, spec, run)
    if path := outputs.get("--counts"):
        from tachometry.sim.signals.tables import write_counts

        write_counts(path, run)
    if path := outputs.get("--events"):
        from tachometry.sim.signals.tables import write_events

        write_events(path, run)
    if path := outputs.get("--save-capture"):
        from tachometry.sim.captures.sigrok import write_sr

        write_sr(path, trace, spec.timing.clock_hz)
    if path := outputs.get("--plot"):
        from tachometry.sim.plots.run import save_plot

        assert not isinstance(spec, AxesSpec), "a figure is of one axis"
        save_plot(path, spec, run, None if truth is None else truth.true_speed)
