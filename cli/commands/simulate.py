"""`tachometry simulate`: a core on a virtual encoder, against its golden model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from tachometry.cli.files import Outputs
from tachometry.cli.options.axes import AXES
from tachometry.cli.options.core import core_options
from tachometry.cli.options.engine import ENGINE_OPTIONS
from tachometry.cli.options.motion import FORMS, MOTION_OPTIONS, Recorder, shown_in_unit_of
from tachometry.cli.options.option import command
from tachometry.cli.options.outputs import OUTPUT_OPTIONS, WHOLE, outputs_of, write_outputs, write_tables
from tachometry.cli.reports.run import print_simulation
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.simulation import Running
from tachometry.sim.studies.simulation import simulate as simulation_of
from tachometry.spec import CoreSpec


@command(f"""{FORMS}

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
a --clock that is a few times the edge rate then.""")
@core_options(AXES)
@MOTION_OPTIONS
@OUTPUT_OPTIONS
@ENGINE_OPTIONS
def simulate(spec: CoreSpec, record: Recorder, tables: list[Path], targets: dict[str, Path], running: Running) -> int:
    """Run a core on a virtual encoder, against the golden model and the truth.

    The hardware is simulated clock by clock and compared with the golden model in every bit of every update and tick.
    The table at the end also shows what was lost on the way, and how far the velocity is from the shaft's.

    Ctrl-C ends the simulation. What was simulated so far is reported, and written beside the outputs, as t.part.csv.
    Equal options give equal files.
    Exit status 1 if hardware and golden model differ.
    """
    outputs = outputs_of(spec, targets, tables)
    spec = shown_in_unit_of(record.motion, spec)
    recordings, truths = zip(
        *(record.flow(spec.tachometer, axis, spec.axes) for axis in range(spec.axes or 1)), strict=True
    )
    return run_core(outputs, running, spec, "--motion", recordings, truths)


def run_core(
    outputs: Outputs,
    running: Running,
    spec: CoreSpec,
    source: str,
    recordings: Sequence[Recording | Flow],
    truths: Sequence[Encoding] | None = None,
) -> int:
    """Simulate a core, write the outputs, and print the results; return the exit status."""
    with outputs:
        whole = any(outputs.get(what) is not None for what in WHOLE)
        sink = partial(write_tables, spec, outputs)
        running = replace(running, vcd=outputs.get("--vcd"), bar=progress_bar, whole=whole, sink=sink)
        simulation = simulation_of(spec, source, recordings, truths, running)
        kept = write_outputs(simulation, outputs)
    return print_simulation(simulation, kept)
