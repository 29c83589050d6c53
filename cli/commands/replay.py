"""`tachometry replay`: a core on captured signals, against its golden model."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import click

from tachometry.cli.commands.simulate import run_core
from tachometry.cli.options.axes import AXES
from tachometry.cli.options.capture import CAPTURE_OPTIONS
from tachometry.cli.options.core import core_options
from tachometry.cli.options.engine import ENGINE_OPTIONS
from tachometry.cli.options.option import FilePath, command
from tachometry.cli.options.outputs import OUTPUT_OPTIONS, outputs_of
from tachometry.sim.signals.flow import Flow
from tachometry.sim.signals.recording import Recording
from tachometry.sim.studies.simulation import Running
from tachometry.spec import CoreSpec


@command("""\b
Examples:
  tachometry replay ramp.sr --ppr 500 --clock 200kHz --tick 1ms --trace v.csv
  tachometry replay scope.csv --time "t [us]" --a CH1 --b CH2 --ppr 1024 \\
      --clock 500kHz --tick 100us --plot run.png

Without a C++ compiler, --engine pysim runs some 10,000 clocks a second: choose
a --clock that is a few times the edge rate then. Edges closer than a clock are flagged as errors or lost.""")
@click.argument("capture", type=FilePath())
@core_options(AXES)
@CAPTURE_OPTIONS
@OUTPUT_OPTIONS
@ENGINE_OPTIONS
def replay(
    spec: CoreSpec,
    capture: Path,
    read: Callable[..., Recording | Flow],
    targets: dict[str, Path],
    running: Running,
) -> int:
    """Run a core on captured encoder signals, against the golden model.

    CAPTURE is a sigrok session (.sr), a text (.csv, .txt, .tsv or .teeth, also with .gz) of an analyser, oscilloscope,
    logger or spreadsheet, with a line of names such as time,a,b, or a waveform (.vcd, .vcd.gz or .fst), whose variables
    are named with their scopes: --a top.a, or --a top.enc[0] for a bit of a vector. - is a text or a .vcd in a pipe.
    Its edges are placed on the core's clock. What the shaft truly did is unknown; all else is as with simulate.

    Ctrl-C ends the simulation. What was simulated so far is reported, and written beside the outputs, as t.part.csv.
    Equal options and captures give
    equal files. Exit status 1 if hardware and golden model differ.
    """
    outputs = outputs_of(spec, targets, [capture])
    recordings = [read(capture, spec, axis, parts=True) for axis in range(spec.axes or 1)]
    return run_core(outputs, running, spec, str(capture), recordings)
