"""`tachometry loop` prints and writes these results."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.text import Text

from tachometry.cli.reports.terminal import print_table, stdout_console
from tachometry.sim.engines.loop import Log
from tachometry.sim.signals.files import write_csv
from tachometry.sim.studies.loops.control import Outcome, mean
from tachometry.sim.studies.sweeping.grid import Loops
from tachometry.sim.studies.sweeping.loops import FIGURES, LoopPoint, row_of
from tachometry.sim.studies.sweeping.sweep import Row
from tachometry.spec.language.units import plural

_UNITS = {
    "time": "s",
    "command": "rad/s",
    "speed": "rad/s",
    "angle": "rad",
    "held": "rad/s",
    "y": "rad/s",
    "z": "rad/s",
    "disturbance": "Nm",
    "current": "A",
    "driven": "A",
    "position": "counts",
}


def print_loop(point: LoopPoint, outcomes: list[Outcome]) -> None:
    """Print a row per seed of one loop, and their mean."""
    rows = [(str(seed), *_cells(row_of(one))) for seed, one in zip(point.seeds, outcomes, strict=True)]
    if len(rows) > 1:
        rows.append(("mean", *_cells(row_of(mean(outcomes)))))
    print_table(("seed", *_heads()), rows)
    stdout_console().print(Text(f"\n{point.setting.spec.heading}; {point.text}"), soft_wrap=True)


def print_loops(found: Loops, rows: Mapping[str, Row], seconds: float) -> None:
    """Print a row per loop, the mean of its seeds."""
    axes = list(found.axes)
    table = [
        (found.points[digest].method, *(found.at[digest].get(name, "-") for name in axes), *_cells(row))
        for digest, row in rows.items()
    ]
    print_table(("method", *axes, *_heads()), table)
    console = stdout_console()
    for name, reason in found.left_out.items():
        console.print(Text(f"{name}: left out: {reason}"), soft_wrap=True)
    n_seeds = len(next(iter(found.points.values())).seeds)
    text = f"\n{plural(len(rows), 'loop')} with {plural(n_seeds, 'seed')} each, run in {seconds:.3g} s"
    console.print(Text(text), soft_wrap=True)


def write_loops(path: Path, found: Loops, rows: Mapping[str, Row]) -> None:
    """Write a CSV with a row per loop: its method, its place on the axes, and the means of its seeds."""
    columns = [column for column, _ in FIGURES.values()]
    axes = list(found.axes)
    table = (
        (
            found.points[digest].method,
            *(found.at[digest].get(name, "") for name in axes),
            *("" if row[column] is None else f"{row[column]:.9g}" for column in columns),
        )
        for digest, row in rows.items()
    )
    write_csv(path, ("method", *axes, *columns), table)


def write_log(path: Path, log: Log) -> None:
    """Write a CSV with a row per instant: what is commanded, what the motor does, what the controller knows."""
    heads = [f"{name} ({_UNITS[name]})" for name in log]
    rows = zip(*(log[name].tolist() for name in log), strict=True)
    write_csv(path, heads, (tuple(f"{value:.9g}" for value in row) for row in rows))


def _heads() -> list[str]:

    return [head for _, head in FIGURES.values()]


def _cells(row: Row) -> list[str]:

    *figures, limited = (row[column] for column, _ in FIGURES.values())
    return [*("-" if value is None else f"{value:.3g}" for value in figures), f"{100 * limited:.3g}%"]
