"""`tachometry sweep` prints this at its end."""

from fractions import Fraction
from pathlib import Path
from statistics import median

from rich.text import Text

from tachometry.cli.reports.terminal import print_table, stdout_console
from tachometry.sim.studies.sweeping.run import SweepResult
from tachometry.spec.language.units import format_time, plural

COLUMNS = (
    "method",
    "relative_error",
    "rms_error_rad_s",
    "delay_s",
    "mean_time_s",
    "worst_time_s",
    "updates_per_s",
    "mismatches",
    "clocks",
)


def print_sweep(result: SweepResult, results: Path | None) -> int:
    """Print a row per method, of all its points, and what was run; values in which the hardware was wrong.

    The result must have these `COLUMNS`.
    """
    grid, columns, n_run, seconds = result.grid, result.columns, result.n_run, result.seconds
    checked = [wrong for wrong in columns["mismatches"] if wrong is not None]
    unit = grid.unit
    errors = ("error/V", "worst", f"RMS ({unit.name})", "worst")
    heads = ("method", "points", *errors, "delay", "T_m", "worst", "updates/s", *(["differ"] if checked else []))
    table = []
    for method in dict.fromkeys(columns["method"]):
        rows = [k for k, name in enumerate(columns["method"]) if name == method]
        of = {name: [values[k] for k in rows if values[k] is not None] for name, values in columns.items()}
        cells = (
            method,
            str(len(rows)),
            *(_number(kind(of["relative_error"], default=None), 100, "%") for kind in (_median, max)),
            *(_number(kind(of["rms_error_rad_s"], default=None), unit.of(1)) for kind in (_median, max)),
            _time(_median(of["delay_s"])),
            _time(_median(of["mean_time_s"])),
            _time(max(of["worst_time_s"], default=None)),
            _number(_median(of["updates_per_s"])),
            *([str(sum(of["mismatches"]))] if checked else []),
        )
        table.append(cells)
    print_table(heads, table)
    console = stdout_console()
    console.print("\nMedians of all points, and the worst. error/V: RMS error over RMS of the true speed.")
    for line in dict.fromkeys(point.spec.words.method for point in grid.points.values() if point.spec.chosen):
        console.print(Text(line), soft_wrap=True)
    for name, reason in grid.left_out.items():
        console.print(Text(f"{name}: left out: {reason}"))
    n_points = plural(len(grid.points), "point")
    rate = f", {n_run} of them run in {_time(seconds)}, {n_run / seconds:.3g} a second" if n_run else ", none run anew"
    where = "" if results is None else f"; rows in {results}"
    console.print(Text(f"{n_points}{rate}{where}"), soft_wrap=True)
    if checked:
        console.print(_verdict(sum(checked), len(checked), sum(columns["clocks"])))
    return sum(checked)


def _verdict(n_wrong: int, n_points: int, n_clocks: int) -> Text:
    if n_wrong:
        return Text(f"FAIL: hardware and golden model differ in {plural(n_wrong, 'value')}", style="bold red")
    verdict = f"PASS: hardware and golden model agree in every bit of {plural(n_points, 'point')}, {n_clocks} clocks"
    return Text(verdict, style="bold green")


def _median(values: list[float], default: None = None) -> float | None:
    return median(values) if values else default


def _number(value: float | None, scale: float = 1, unit: str = "") -> str:
    return "-" if value is None else f"{value * scale:.3g}{unit}"


def _time(seconds: float | None) -> str:
    """Return a time to three digits."""
    if seconds is None:
        return "-"
    return ("-" if seconds < 0 else "") + format_time(Fraction(f"{abs(seconds):.3g}"))
