"""`tachometry compare`: several methods on the same edges."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tachometry.cli.core_options import common_options
from tachometry.cli.files import Outputs
from tachometry.cli.methods import Methods, named_methods
from tachometry.cli.motion_options import FORMS, motion_options
from tachometry.cli.options import GroupedCommand, option, output
from tachometry.spec import Encoder, TachometerSpec
from tachometry.spec.units import format_time

if TYPE_CHECKING:  # numpy is slow to import, and --help does not need it
    from tachometry.sim.compare import Curve, Score
    from tachometry.sim.encoder import Encoding


@click.command(
    cls=GroupedCommand,
    short_help="Compare methods on the same edges of a virtual encoder.",
    epilog=f"""{FORMS}

\b
Examples:
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --motion "ramp:0:100rad/s:200ms+stop:50ms" --jitter 0.05 --plot all.png
  tachometry compare --ppr 500 --clock 10MHz --tick 100us \\
      --methods "s,s:cancel=no,m:average=10,hostmot2" \\
      --motion "sine:50rad/s:5Hz:1s" """,
)
@common_options
@option(
    "Methods",
    "--methods",
    default="all",
    metavar="LIST",
    help="Names with commas between: methods of cores, with options as in m:average=10 or s:cancel=no, and difference, "
    "hostmot2, simplefoc, odrive, moteus: float models of what is in use.",
)
@motion_options
@output("--plot", suffixes=(".png", ".pdf"), help="Figure of all velocities and of the error of each; .png or .pdf.")
@output("--csv", help="CSV with a row per method: the table.")
def compare(
    make: Callable[[str, dict[str, Any]], TachometerSpec],
    methods: str,
    record: Callable[[TachometerSpec], Encoding],
    tables: list[Path],
    plot: Path | None,
    csv: Path | None,
) -> int:
    """Compare methods on the same edges of a virtual encoder.

    Cores are run by their golden models, which the hardware equals bit for bit; the others are float models with the
    settings that their projects come with. Errors are those of the held velocity against the shaft's, from when every
    method has given its first value; the delay is the shift of the true speed that comes closest.
    """
    from tachometry.sim.compare import RIVALS, common_instants, score

    given = {"--plot": plot, "--csv": csv}
    outputs = Outputs({name: path for name, path in given.items() if path is not None}, inputs=tables)
    named = named_methods(methods, make, RIVALS)
    spec = make("s", {})
    chosen = _chosen(named, spec.encoder)
    with outputs:
        truth = record(spec)
        duration = truth.recording.duration
        curves = [curve(truth) for curve in chosen]
        instants = common_instants(curves, duration, float(spec.timing.tick_seconds))
        if len(instants) < 2:
            raise ValueError(f"motion must last until every method has a value, longer than {_time(duration)}")
        scores = [score(curve, duration, instants, truth.true_speed) for curve in curves]
        if path := outputs.get("--csv"):
            _write(path, scores)
        if path := outputs.get("--plot"):
            from tachometry.sim.compare_plot import save_comparison

            save_comparison(path, spec, curves, scores, instants, truth.true_speed)
    _print(scores, named.left_out)
    return 0


def _time(seconds: float) -> str:
    """A time to four digits."""
    from fractions import Fraction

    return format_time(Fraction(f"{seconds:.4g}"))


def _chosen(named: Methods, encoder: Encoder) -> list[Callable[[Encoding], Curve]]:
    """What is to be compared, each from what the encoder gave."""
    from tachometry.sim.compare import core_curve, rival_curve

    def core(name: str, spec: TachometerSpec) -> Callable[[Encoding], Curve]:
        return lambda truth: core_curve(name, spec, truth.recording.place(spec.timing.clock_hz))

    def rival(name: str) -> Callable[[Encoding], Curve]:
        return lambda truth: rival_curve(name, truth.recording, encoder.counts_per_rev, encoder.decoding)

    return [rival(name) if spec is None else core(name, spec) for name, spec in named.specs.items()]


_HEADS = ("method", "updates/s", "T_m mean", "T_m worst", "RMS (rad/s)", "max (rad/s)", "delay")


def _print(scores: list[Score], left_out: dict[str, str]) -> None:
    from rich.table import Table
    from rich.text import Text

    from tachometry.cli.report import stdout_console

    def time(seconds: float | None) -> str:
        return "-" if seconds is None else ("-" if seconds < 0 else "") + _time(abs(seconds))

    table = Table(box=None, pad_edge=False, header_style="")
    for head in _HEADS:
        table.add_column(head, justify="left" if head == _HEADS[0] else "right", no_wrap=True)
    for row in scores:
        cells = (
            row.name,
            f"{row.updates_per_second:.4g}",
            time(row.mean_time),
            time(row.worst_time),
            "-" if row.rms is None else f"{row.rms:.4g}",
            "-" if row.max is None else f"{row.max:.4g}",
            time(row.delay),
        )
        table.add_row(*map(Text, cells))
    console = stdout_console()
    console.print(table)
    console.print()
    for row in scores:
        console.print(Text(f"{row.name}: {row.what}"))
    for name, reason in left_out.items():
        console.print(Text(f"{name}: left out: {reason}"))


def _write(path: Path, scores: list[Score]) -> None:
    import csv

    names = [name for name in vars(scores[0]) if name != "what"]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(names)
        writer.writerows([["" if (value := getattr(row, name)) is None else value for name in names] for row in scores])
