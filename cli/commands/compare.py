"""`tachometry compare`: several methods on the same edges."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.capture import capture_options
from tachometry.cli.options.core import Make, common_core_options
from tachometry.cli.options.methods import Methods, named_methods
from tachometry.cli.options.motion import FORMS, optional_motion_options
from tachometry.cli.options.option import FilePath, GroupedCommand, option, output
from tachometry.spec import Encoder, TachometerSpec
from tachometry.spec.units import SpeedUnit, format_time, parse_time

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.encoder.virtual import Encoding
    from tachometry.sim.signals.recording import Recording
    from tachometry.sim.studies.compare import Curve, Score, TrueSpeed
    from tachometry.sim.studies.size import Measurement


@click.command(
    cls=GroupedCommand,
    short_help="Compare methods on the same edges.",
    epilog=f"""{FORMS}

\b
Examples:
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --motion "ramp:0:100rad/s:200ms+stop:50ms" --jitter 0.05 --plot all.png
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --methods "s,s:cancel=no,m:average=10,hostmot2" \\
      --motion "sine:50rad/s:5Hz:1s" --size
  tachometry compare --ppr 500 --clock 200kHz --tick 1ms --replay ramp.sr""",
)
@common_core_options
@option(
    "Methods",
    "--methods",
    default="all",
    metavar="LIST",
    help="Methods to compare: all, or names with commas between. Methods of cores take options, as in m:average=10 or "
    "s:cancel=no; difference, hostmot2, simplefoc, odrive and moteus are float models of what is in use.",
)
@optional_motion_options
@option(
    "Capture",
    "--replay",
    "capture",
    metavar="CAPTURE",
    type=FilePath(),
    help="Captured lines instead of a --motion: .sr, .csv or .vcd, as `tachometry replay` takes them.",
)
@capture_options
@option(
    "Methods",
    "--from",
    "start",
    metavar="TIME",
    help="Leave out errors before this time, in s, ms, us or ns. [default: until every method has a value]",
)
@option(
    "Methods",
    "--size",
    is_flag=True,
    help="Also measure the cores on an ECP5: COMB, FF, Fmax. It takes half a minute a core, and needs the extra "
    "`size`.",
)
@output("--plot", suffixes=(".png", ".pdf"), help="Figure of all velocities and of the error of each; .png or .pdf.")
@output("--csv", help="CSV with a row per method: the table.")
def compare(
    make: Make,
    methods: str,
    record: Callable[[TachometerSpec], Encoding] | None,
    tables: list[Path],
    capture: Path | None,
    read: Callable[[Path, TachometerSpec], Recording],
    start: str | None,
    size: bool,
    plot: Path | None,
    csv: Path | None,
) -> int:
    """Compare methods on the same edges, of a virtual encoder or a capture.

    Cores are run by their golden models, which the hardware equals bit for bit; the others are float models with the
    settings that their projects come with. Errors are those of the held velocity against the shaft's, from when every
    method has given its first value; the delay is the shift of the true speed that comes closest. It is left out
    where it says nothing: at constant speed, and where noise hides it. A capture does not tell the true speed, so there
    are no errors.
    """
    from tachometry.sim.studies.compare import common_instants, score
    from tachometry.sim.studies.rivals import BASELINES

    given = {"--plot": plot, "--csv": csv}
    inputs = tables if capture is None else [capture]
    outputs = Outputs({name: path for name, path in given.items() if path is not None}, inputs=inputs)
    named = named_methods(methods, make, BASELINES)
    spec = next((spec for spec in named.specs.values() if spec is not None), None) or make("s", {})
    source = _source(record, capture, read, spec)
    earliest = 0.0 if start is None else float(parse_time("start", start))
    if earliest < 0:
        raise ValueError(f"--from must be at least 0, not {start}")
    tools = _tools() if size else {}
    with outputs:
        duration = source.recording.duration
        curves = [curve(source.recording) for curve in _chosen(named, spec.encoder)]
        instants = common_instants(curves, duration, float(spec.timing.tick_seconds), earliest)
        if len(instants) < 2:
            until = "" if start is None else ", and beyond --from"
            raise ValueError(
                f"{source.name} must last until every method has a value{until}, longer than {_time(duration)}"
            )
        scores = [score(curve, duration, instants, source.true_speed) for curve in curves]
        sizes = _sizes(named, tools) if size else {}
        if path := outputs.get("--csv"):
            _write(path, scores, sizes, spec.shown_unit)
        if path := outputs.get("--plot"):
            from tachometry.sim.plots.compare import save_comparison

            save_comparison(path, spec, curves, scores, instants, source.true_speed)
    _print(scores, sizes, named, spec.shown_unit)
    from tachometry.cli.reports.run import merged_edges, print_warnings

    clock_hz = spec.timing.clock_hz
    print_warnings(merged_edges(source.recording, clock_hz, int(duration * clock_hz)))
    return 0


@dataclass(frozen=True)
class _Source:
    """Where the edges come from; a capture does not tell the true speed."""

    name: str
    recording: Recording
    true_speed: TrueSpeed | None


def _source(
    record: Callable[[TachometerSpec], Encoding] | None,
    capture: Path | None,
    read: Callable[[Path, TachometerSpec], Recording],
    spec: TachometerSpec,
) -> _Source:
    if (record is None) == (capture is None):
        raise ValueError("--motion must be given, or --replay, and not both")
    if capture is not None:
        return _Source(str(capture), read(capture, spec), None)
    assert record is not None
    truth = record(spec)
    return _Source("--motion", truth.recording, truth.true_speed)


def _tools() -> dict[str, str]:
    """Versions of what measures sizes."""
    from tachometry.sim.studies.size import versions

    try:
        return versions()
    except RuntimeError as error:
        raise click.ClickException(f"--size needs the extra `size`: {error}") from error


def _sizes(named: Methods, tools: dict[str, str]) -> dict[str, Measurement]:
    """COMB, FF and Fmax of the cores on an ECP5, by name."""
    from rich.progress import MofNCompleteColumn, TextColumn

    from tachometry.cli.reports.terminal import progress_bar
    from tachometry.hdl import export
    from tachometry.sim.studies.size import CORE, TARGETS, measure_core

    specs = {name: spec for name, spec in named.specs.items() if spec is not None}
    sizes = {}
    with progress_bar("measuring sizes", len(specs), MofNCompleteColumn(), TextColumn("cores")) as report:
        for done, (name, spec) in enumerate(specs.items(), 1):
            verilog = export(spec, CORE)[f"{CORE}.v"]
            try:
                sizes[name] = measure_core(spec, TARGETS["ECP5"], verilog, tools)
            except RuntimeError as error:
                raise click.ClickException(str(error)) from error
            if report is not None:
                report(done)
    return sizes


def _time(seconds: float) -> str:
    """A time to four digits."""
    from fractions import Fraction

    return format_time(Fraction(f"{seconds:.4g}"))


def _chosen(named: Methods, encoder: Encoder) -> list[Callable[[Recording], Curve]]:
    """What is to be compared, each from what the encoder gave."""
    from tachometry.sim.signals.recording import PinTrace
    from tachometry.sim.studies.compare import core_curve
    from tachometry.sim.studies.rivals import baseline_curve

    def core(name: str, spec: TachometerSpec) -> Callable[[Recording], Curve]:
        return lambda recording: core_curve(name, spec, PinTrace.of(recording, spec))

    def baseline(name: str) -> Callable[[Recording], Curve]:
        return lambda recording: baseline_curve(name, recording, encoder.counts_per_rev, encoder.decoding)

    return [baseline(name) if spec is None else core(name, spec) for name, spec in named.specs.items()]


_SPEEDS = ("rms", "max")  # of a score, in rad/s
_SIZE = {"COMB": "{:.0f}", "FF": "{:.0f}", "Fmax": "{:.0f}MHz"}


def _print(scores: list[Score], sizes: dict[str, Measurement], named: Methods, unit: SpeedUnit) -> None:
    from rich.text import Text

    from tachometry.cli.reports.terminal import print_table, stdout_console

    def time(seconds: float | None) -> str:
        return "-" if seconds is None else ("-" if seconds < 0 else "") + _time(abs(seconds))

    rows = [
        (
            row.name,
            f"{row.updates_per_second:.4g}",
            time(row.mean_time),
            time(row.worst_time),
            "-" if row.rms is None else f"{unit.of(row.rms):.4g}",
            "-" if row.max is None else f"{unit.of(row.max):.4g}",
            time(row.delay),
            *(_size_cells(sizes.get(row.name)) if sizes else ()),
        )
        for row in scores
    ]
    errors = (f"RMS ({unit.name})", f"max ({unit.name})")
    heads = ("method", "updates/s", "T_m mean", "T_m worst", *errors, "delay")
    print_table((*heads, *(_SIZE if sizes else ())), rows)
    console = stdout_console()
    console.print()
    for row in scores:
        console.print(Text(f"{row.name}: {row.what}"))
    if sizes:
        console.print("COMB, FF, Fmax: of the core on an ECP5, see docs/size.md")
    for name, spec in named.specs.items():
        for note in spec.notes if spec is not None else ():
            console.print(Text(f"{name}: {note}"))
    for name, reason in named.left_out.items():
        console.print(Text(f"{name}: left out: {reason}"))


def _size_cells(size: Measurement | None) -> list[str]:
    return ["-" if size is None else form.format(size.figures[figure]) for figure, form in _SIZE.items()]


def _write(path: Path, scores: list[Score], sizes: dict[str, Measurement], unit: SpeedUnit) -> None:
    from tachometry.sim.signals.files import write_csv

    names = [name for name in vars(scores[0]) if name != "what"]
    figures = list(_SIZE) if sizes else []

    def cells(row: Score) -> list[object]:
        size = sizes.get(row.name)
        values = [getattr(row, name) for name in names]
        shown = [
            unit.of(value) if name in _SPEEDS and value is not None else value
            for name, value in zip(names, values, strict=True)
        ]
        return shown + [size and size.figures[figure] for figure in figures]

    heads = [f"{name}_{unit.suffix}" if name in _SPEEDS else name for name in names]
    write_csv(path, [*heads, *figures], map(cells, scores))
