"""`tachometry simulate` and `tachometry replay`: the core against its golden model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.capture import capture_options
from tachometry.cli.options.core import core_options
from tachometry.cli.options.engine import engine_options
from tachometry.cli.options.motion import FORMS, motion_options
from tachometry.cli.options.option import GroupedCommand, output_options
from tachometry.spec import TachometerSpec
from tachometry.spec.units import format_time

if TYPE_CHECKING:  # numpy and Amaranth are slow to import, and --help needs neither
    from tachometry.sim.encoder.virtual import Encoding
    from tachometry.sim.signals.recording import PinTrace, Recording
    from tachometry.sim.signals.run import Run

    Window = Callable[[TachometerSpec, int], tuple[int, int]]


@click.command(
    cls=GroupedCommand,
    short_help="Run a core on a virtual encoder, against the golden model and the truth.",
    epilog=f"""{FORMS}

\b
Examples:
  tachometry simulate --ppr 500 --clock 200kHz --tick 1ms \\
      --motion ramp:0:40rad/s:500ms --plot ramp.png
  tachometry simulate --ppr 1024 --clock 500kHz --tick 100us \\
      --motion trapezoid:900rpm:100ms:50ms+stop:20ms \\
      --jitter 0.05 --illegal 0.001 --vcd run.vcd --trace run.csv
  tachometry simulate --ppr 24 --clock 100kHz --tick 2ms --max-time 100ms \\
      --motion constant:15rpm:1s --bounce 5:1ms --filter 110 --plot knob.png

Without a C++ compiler, --engine pysim runs some 10,000 clocks a second: choose
a --clock that is a few times the edge rate then.""",
)
@core_options
@motion_options
@output_options
@engine_options
def simulate(
    spec: TachometerSpec,
    record: Callable[[TachometerSpec], Encoding],
    tables: list[Path],
    targets: dict[str, Path],
    engine: str,
    window: Window,
) -> int:
    """Run a core on a virtual encoder, against the golden model and the truth.

    The hardware is simulated clock by clock and compared with the golden model in every bit of every update and tick.
    The table at the end also tells what was lost on the way, and how far the velocity is from the shaft's.

    Ctrl-C ends the simulation, and what was simulated so far is told and written. Equal options give equal files. Exit
    status 1 if hardware and golden model differ.
    """
    outputs = Outputs(targets, inputs=tables)
    truth = record(spec)
    return _run_and_report(spec, "--motion", truth.recording, truth, outputs, engine, window)


@click.command(
    cls=GroupedCommand,
    short_help="Run a core on captured encoder signals, against the golden model.",
    epilog="""\b
Examples:
  tachometry replay ramp.sr --ppr 500 --clock 200kHz --tick 1ms --trace v.csv
  tachometry replay scope.csv --a CH1 --b CH2 --ppr 1024 \\
      --clock 500kHz --tick 100us --plot run.png

Without a C++ compiler, --engine pysim runs some 10,000 clocks a second: choose
a --clock that is a few times the edge rate then. Edges closer than a clock are flagged as errors or lost.""",
)
@click.argument("capture", type=click.Path(path_type=Path))
@core_options
@capture_options
@output_options
@engine_options
def replay(
    spec: TachometerSpec,
    capture: Path,
    read: Callable[[Path, TachometerSpec], Recording],
    targets: dict[str, Path],
    engine: str,
    window: Window,
) -> int:
    """Run a core on captured encoder signals, against the golden model.

    CAPTURE is a sigrok session (.sr), a text (.csv) with the header time,a,b, times in seconds and levels 0 or 1, or a
    waveform (.vcd), whose one-bit variables are named with their scopes: --a top.a --b top.b.
    Its edges are placed on the core's clock. What the shaft truly did is unknown; all else is as with simulate.

    Ctrl-C ends the simulation, and what was simulated so far is told and written. Equal options and captures give equal
    files. Exit status 1 if hardware and golden model differ.
    """
    outputs = Outputs(targets, inputs=[capture])
    return _run_and_report(spec, str(capture), read(capture, spec), None, outputs, engine, window)


def _run_and_report(
    spec: TachometerSpec,
    source: str,
    recording: Recording,
    truth: Encoding | None,
    outputs: Outputs,
    engine: str,
    window: Window,
) -> int:
    """Run hardware and golden model, write what is wanted, print the summary; the exit status."""
    from tachometry.cli.reports.run import clocks_progress, interrupted, print_summary
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
    print_summary(spec, actual, truth, found.n_mismatches, found.first, chosen.name + missing)
    if found.n_mismatches:
        return 1
    return interrupted(actual.n_clocks, wanted) if actual.n_clocks < wanted else 0


def _least(spec: TachometerSpec) -> int:
    """Fewest clocks of which something can be told."""
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
