"""What simulate and replay share: run hardware and golden model, and report."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tachometry.cli.files import Outputs
from tachometry.spec import TachometerSpec
from tachometry.spec.units import format_time

if TYPE_CHECKING:  # numpy and Amaranth are slow to import, and --help needs neither
    from tachometry.sim.encoder.virtual import Encoding
    from tachometry.sim.signals.recording import PinTrace, Recording
    from tachometry.sim.signals.run import Run

Window = Callable[[TachometerSpec, int], tuple[int, int]]


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
    from tachometry.cli.reports.run import interrupted, print_summary
    from tachometry.cli.reports.terminal import clocks_progress
    from tachometry.sim.engines.pick import pick
    from tachometry.sim.signals.recording import PinTrace
    from tachometry.sim.studies.lockstep import lockstep

    trace = PinTrace.of(recording, spec)
    _require_a_tick(spec, source, trace)
    shown, chosen, wanted = window(spec, trace.n_clocks), pick(engine), trace.n_clocks
    with outputs:
        with clocks_progress(trace.n_clocks) as progress:
            vcd, fewest = outputs.get("--vcd"), _least(spec)
            found = lockstep(spec, trace, chosen, vcd=vcd, window=shown, progress=progress, fewest=fewest)
        _write(spec, found.trace, found.actual, truth, outputs)
    actual = found.actual
    missing = " (there is no C++ compiler)" if (engine, chosen.name) == ("auto", "pysim") else ""
    print_summary(spec, actual, recording, truth, found.n_mismatches, found.first, chosen.name + missing)
    if found.n_mismatches:
        return 1
    return interrupted(actual.n_clocks, wanted) if actual.n_clocks < wanted else 0


def _least(spec: TachometerSpec) -> int:
    """Fewest clocks after which there is something to report."""
    return spec.longest_tick + spec.tick_latency


def _require_a_tick(spec: TachometerSpec, source: str, trace: PinTrace) -> None:
    needed = _least(spec)
    if trace.n_clocks < needed:
        raise ValueError(
            f"{source} must last at least {needed} clocks of --clock ({format_time(spec.seconds(needed))}), "
            f"a tick and its latency, not {trace.n_clocks}"
        )


def _write(spec: TachometerSpec, trace: PinTrace, run: Run, truth: Encoding | None, outputs: Outputs) -> None:
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

        save_plot(path, spec, run, None if truth is None else truth.true_speed)
