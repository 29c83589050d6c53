"""Options of the files that a simulation writes, and what writes each."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tachometry.cli.files import Outputs
from tachometry.cli.options.option import Group, output
from tachometry.sim.captures.sigrok import write_sr
from tachometry.sim.signals.run import Run
from tachometry.sim.signals.tables import Tally, write_counts, write_events, write_trace
from tachometry.sim.studies.simulation import Simulation
from tachometry.spec import CoreSpec

_VCD = "Waveform of pins, ports and inner values. A GTKWave save file (.gtkw) beside it opens it."
_TRACE = """CSV with a row per update. Its columns: clock, tick, interval (the manifest has its unit), forced, raw \
velocity, velocity in rad/s, or in the unit of --unit; then all other outputs that change with an update."""
_COUNTS = "CSV with a row per tick. Its columns: tick, pulse count, position (counts), and all other outputs of a tick."
_SAVE_CAPTURE = "Capture of the lines, as sigrok has it. PulseView and `tachometry replay` read it."


_OPTIONS = [
    output("--vcd", suffixes=(".vcd",), help=_VCD),
    output("--plot", suffixes=(".png", ".pdf", ".svg"), help="Figure of velocity, error, pulse numbers, times."),
    output("--trace", help=_TRACE),
    output("--counts", help=_COUNTS),
    output("--events", help="CSV with a row per index, illegal edge and wrong tick."),
    output("--save-capture", suffixes=(".sr",), help=_SAVE_CAPTURE),
]


def _read(**given: Any) -> dict[str, Any]:
    names = ("vcd", "plot", "trace", "counts", "events", "save_capture")
    paths: dict[str, Path | None] = {f"--{name.replace('_', '-')}": given.pop(name) for name in names}
    if (vcd := paths["--vcd"]) is not None:
        paths["--vcd (its .gtkw)"] = vcd.with_suffix(".gtkw")
    return dict(targets={what: path for what, path in paths.items() if path is not None}, **given)


OUTPUT_OPTIONS = Group(_OPTIONS, _read)
"""Handed over as `targets`, a dictionary of option to path; a `.gtkw` comes with `--vcd`."""


WHOLE = ("--vcd", "--plot", "--save-capture")  # what needs all rows or pins at once


def outputs_of(spec: CoreSpec, targets: Mapping[str, Path], inputs: Sequence[Path]) -> Outputs:
    """Return the outputs of a simulation of this core, see `Outputs`."""
    outputs = Outputs(targets, inputs)
    if spec.axes is not None and "--plot" in targets:
        raise ValueError("--plot must not be given together with --axes: a figure is of one axis")
    if "--save-capture" in targets and spec.tachometer.encoder.sampled is not None:
        raise ValueError("--save-capture must not be given with positions that are read: it has A and B")
    return outputs


def write_tables(spec: CoreSpec, outputs: Outputs, run: Run, tally: Tally) -> None:
    """Write the rows of a run, or of the next piece of one, see `write_trace`."""
    if path := outputs.get("--trace"):
        write_trace(path, spec, run, tally)
    if path := outputs.get("--counts"):
        write_counts(path, run, tally)
    if path := outputs.get("--events"):
        write_events(path, run, tally)


def write_outputs(simulation: Simulation, outputs: Outputs) -> list[Path]:
    """Write what needs a whole simulation, but the waveform, which is there already.

    Those of an interrupted one leave the outputs as they were, and are returned: they lie beside them, as `t.part.csv`.
    """
    spec, run, place = simulation.spec, simulation.lockstep.actual, outputs.get
    if path := place("--save-capture"):
        write_sr(path, simulation.lockstep.trace, spec.timing.clock_hz)
    if path := place("--plot"):
        from tachometry.sim.plots.run import save_plot  # Matplotlib is slow to import

        assert spec.axes is None, "a figure is of one axis"
        truth = simulation.axes[0].truth
        save_plot(path, spec.tachometer, run, None if truth is None else truth.true_speed)
    return outputs.keep_all() if simulation.interrupted else []
