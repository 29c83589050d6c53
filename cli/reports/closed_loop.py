"""`tachometry loop` prints and writes these results."""

from collections.abc import Iterator

from rich.text import Text

from tachometry.cli.reports.terminal import print_table, stdout_console
from tachometry.sim.engines.loop import Log
from tachometry.sim.studies.sweeping.loops import FIGURES
from tachometry.sim.studies.sweeping.run import LoopResult
from tachometry.sim.studies.sweeping.sweep import Row
from tachometry.spec.language.units import plural

_MUCH = 0.1  # share of a run at the limit of the current of which a user is warned
_HEADS = [head for _, head in FIGURES.values()]
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


def print_loops(result: LoopResult) -> None:
    """Print a row per seed of a loop that is alone, and their mean; else a row per loop, the mean of its seeds."""
    _print_table(result)
    *_, (limited, _) = FIGURES.values()
    if (worst := max((row[limited] or 0 for row in result.rows.values()), default=0)) > _MUCH:
        text = f"the current is at its limit for {100 * worst:.3g}% of the run: raise --current-limit, or take a slower"
        stdout_console().print(Text(f"WARNING: {text} --motion", style="bold yellow"), soft_wrap=True)


def _print_table(result: LoopResult) -> None:
    grid, axes = result.grid, list(result.grid.axes)
    first = next(iter(grid.points.values()))
    if result.seeds:
        rows = [(str(seed), *_cells(row)) for seed, row in zip(first.seeds, result.seeds, strict=True)]
        means = [("mean", *_cells(row)) for row in result.rows.values()] if len(rows) > 1 else []
        print_table(("seed", *_HEADS), [*rows, *means])
        stdout_console().print(Text(f"\n{first.setting.spec.words.method}; {first.text}"), soft_wrap=True)
        return
    table = [
        (grid.points[digest].method, *(grid.at[digest].get(name, "-") for name in axes), *_cells(row))
        for digest, row in result.rows.items()
    ]
    print_table(("method", *axes, *_HEADS), table)
    console = stdout_console()
    specs = [point.setting.spec for point in grid.points.values()]
    for line in dict.fromkeys(spec.words.method for spec in specs if spec.chosen):
        console.print(Text(line), soft_wrap=True)
    for name, reason in grid.left_out.items():
        console.print(Text(f"{name}: left out: {reason}"), soft_wrap=True)
    loops, seeds = plural(len(table), "loop"), plural(len(first.seeds), "seed")
    console.print(Text(f"\n{loops} with {seeds} each, run in {result.seconds:.3g} s"), soft_wrap=True)


def loop_table(result: LoopResult) -> tuple[list[str], list[list[str]]]:
    """Return heads and a row per loop: its method, its place on the axes, and the means of its seeds."""
    grid, axes, columns = result.grid, list(result.grid.axes), [column for column, _ in FIGURES.values()]
    rows = [
        [
            grid.points[digest].method,
            *(grid.at[digest].get(name, "") for name in axes),
            *("" if row[column] is None else f"{row[column]:.9g}" for column in columns),
        ]
        for digest, row in result.rows.items()
    ]
    return ["method", *axes, *columns], rows


def log_table(log: Log) -> tuple[list[str], Iterator[tuple[str, ...]]]:
    """Return heads and a row per instant: what is commanded, what the motor does, what the controller knows."""
    rows = zip(*(log[name].tolist() for name in log), strict=True)
    return [f"{name} ({_UNITS[name]})" for name in log], (tuple(f"{value:.9g}" for value in row) for row in rows)


def _cells(row: Row) -> list[str]:
    *figures, limited = (row[column] for column, _ in FIGURES.values())
    return [*("-" if value is None else f"{value:.3g}" for value in figures), f"{100 * limited:.3g}%"]
