"""`tachometry figures`: the papers' figures anew, and whether they agree with what the papers say of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.option import GroupedCommand, check_plots, option, output_folder
from tachometry.cli.reports.figures import print_figures
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.signals.progress import Progress

if TYPE_CHECKING:  # numpy and Amaranth are slow to import, and --help needs neither
    from tachometry.sim.figures.lab import Lab
    from tachometry.sim.figures.result import Entry, Result

_FIGURES = "Figures"
_KINDS = ("svg", "png", "csv")
_SUMMARY = "claims.csv"


@click.command(
    cls=GroupedCommand,
    epilog="""\b
Examples:
  tachometry figures
  tachometry figures --only tsuji7,tsuji8 -o build/resolution""",
)
@option(
    _FIGURES,
    "--only LIST",
    default="all",
    help="Figures to draw: all, or names with commas between: tsuji5, tsuji6, tsuji7, tsuji8, tsuji9, tsuji12, "
    "tsuji13, tsuji14, tsuji15 (Tsuji 2009), rairan2, rairan3, rairan5, rairan7 (Rairán 2013). The last three of Tsuji "
    "need a C++ compiler; without one, all leaves them out.",
)
@option(
    _FIGURES,
    "--hdl/--no-hdl",
    default=True,
    help="Simulate the hardware beside the golden models of tsuji12, rairan5 and rairan7, which takes most of "
    "the time.",
)
@output_folder(
    "build/figures",
    help="Folder of the .svg, .png and .csv of each figure, and of claims.csv, which has a row per claim.",
)
def figures(only: str, hdl: bool, directory: Path) -> int:
    """Draw the papers' figures anew, and tell which agree.

    Each is computed from the equations and the golden models, and held against what its paper says of it: the table at
    the end shows what came out. See docs/measured/figures.md.

    Equal options give equal files. Exit status 1 if hardware and golden model differ.
    """
    check_plots("tachometry figures")
    from tachometry.sim.figures.drawing import write_claims, write_data, write_figure
    from tachometry.sim.figures.lab import Lab

    chosen = _chosen(only)
    names = [f"{entry.name}.{kind}" for entry in chosen for kind in _KINDS] + [_SUMMARY]
    results: dict[str, Result] = {}
    labs: dict[str, Lab] = {}
    with (
        Outputs({name: directory / name for name in names}) as outputs,
        progress_bar("drawing", sum(entry.seconds for entry in chosen)) as report,
    ):
        before = 0.0
        for entry in chosen:
            lab = labs[entry.name] = Lab(hdl, _within(report, before, entry))
            result = results[entry.name] = entry.compute(lab)
            for kind in ("svg", "png"):
                write_figure(outputs[f"{entry.name}.{kind}"], result)
            write_data(outputs[f"{entry.name}.csv"], result)
            before += entry.seconds
            report(before)
        write_claims(outputs[_SUMMARY], results)
    print_figures(results, labs, directory)
    return 1 if any(lab.mismatches for lab in labs.values()) else 0


def _chosen(only: str) -> list[Entry]:
    from tachometry.sim.figures import FIGURES

    if only.strip() == "all":
        from tachometry.sim.build import find_compiler

        return [entry for entry in FIGURES.values() if not entry.compiled or find_compiler() is not None]
    names = list(dict.fromkeys(name.strip() for name in only.split(",")))
    for name in names:
        if name not in FIGURES:
            raise ValueError(f"--only must be of {', '.join(FIGURES)}, or all, not {name!r}")
    return [FIGURES[name] for name in names]


def _within(report: Progress, before: float, entry: Entry) -> Progress:
    """Return what a figure's lab reports to: the share of the figure that is done."""
    return lambda share: report(before + share * entry.seconds)
