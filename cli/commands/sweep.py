"""`tachometry sweep`: many cores on many motions, on all processors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.motion import FORMS, delay, read_delay
from tachometry.cli.options.option import FilePath, option, output
from tachometry.cli.options.points import points_of
from tachometry.cli.options.sweep import JOBS, SCHEDULER, VaryingCommand, check_machines, point_options
from tachometry.cli.options.sweep_settings import Settings
from tachometry.cli.reports.sweep import COLUMNS, print_sweep
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.engines.pick import pick
from tachometry.sim.studies.sweeping.grid import Points
from tachometry.sim.studies.sweeping.run import SweepResult, run_sweep
from tachometry.spec import AUTO

# What a heat map can show: the column, what it is, and whether colours go by its logarithm. Columns of speeds are in
# rad/s, and are shown in the unit of the cores.
METRICS = {
    "relative-error": ("relative_error", "RMS error over true speed", True),
    "rms-error": ("rms_error_rad_s", "RMS error ({unit})", True),
    "max-error": ("max_error_rad_s", "greatest error ({unit})", True),
    "delay": ("delay_s", "delay (s)", False),
    "mean-time": ("mean_time_s", "mean measurement time (s)", True),
    "worst-time": ("worst_time_s", "longest measurement time (s)", True),
    "updates": ("updates_per_s", "updates per second", True),
    "mismatches": ("mismatches", "mismatches", False),
}

_VARY = """Option and its values: --vary method=s,mt. An option of cores, methods, motion or encoder, or a name in \
braces within --motion. LO..HI:N are N values, evenly spaced, LO..HI:Nlog are spaced by a factor; none leaves the \
option out. It may be given several times: all combinations are run."""
_METHODS = """Methods to run: auto, all, or names with commas between. auto chooses one for each point, as --method \
does. Names may have options, as in m:average=10."""
_FROM = "Leave out errors before TIME (s, ms, us or ns). [default: until there is a value]"
_RESULTS = "Parquet with a row per point. Points that are in it already do not run again."


@click.command(
    cls=VaryingCommand,
    points=point_options,
    epilog=f"""{FORMS}

\b
Examples:
  tachometry sweep docs/guides/sweep.toml
  tachometry sweep --ppr 500 --motion "constant:{{speed}}:200ms" \\
      --vary speed=1rad/s..1000rad/s:20log --vary tick=10us,20us,50us \\
      --methods s,mt --results sweep.parquet --plot sweep.png
  tachometry sweep docs/guides/sweep.toml --vary seed=1..10:10 \\
      --scheduler tcp://host:8786""",
)
@click.argument("file", required=False, type=FilePath())
@option("Sweep", "--vary NAME=VALUES", multiple=True, help=_VARY)
@option("Sweep", "--methods LIST", default=AUTO, help=_METHODS)
@option("Sweep", "--from TIME", "start", help=_FROM)
@read_delay("Sweep")
@option(
    "Sweep",
    "--engine",
    type=click.Choice(["auto", "pysim", "cxxrtl", "verilator"], case_sensitive=False),
    help="Also run the hardware, in lockstep with the golden model. [default: only the golden model, which "
    "the hardware equals bit for bit]",
)
@JOBS
@SCHEDULER
@output("--results", suffixes=(".parquet",), help=_RESULTS)
@output("--plot", suffixes=(".png", ".pdf", ".svg"), help="Heat map over two axes, a panel per method.")
@option("Outputs", "--axes X,Y", help="Axes of the heat map. [default: the first two]")
@option(
    "Outputs",
    "--metric METRIC",
    type=click.Choice(list(METRICS), case_sensitive=False),
    default="relative-error",
    help=f"Value of the heat map, the median over all other axes. It is one of {', '.join(METRICS)}.",
)
@click.pass_obj
def sweep(
    settings: Settings,
    /,
    file: Path | None,
    methods: str,
    start: str | None,
    read_delay: str,
    engine: str | None,
    jobs: int | None,
    scheduler: str | None,
    results: Path | None,
    plot: Path | None,
    axes: str | None,
    metric: str,
    **_: Any,
) -> int:
    """Run methods over ranges of options and speeds, on all processors.

    FILE is a sweep in TOML: keys are the options of this command, and a table [vary] has the axes. What is given on the
    command line replaces it.

    Every method is run at every combination of the values of the axes, each point on a virtual encoder of its own, by
    the golden model of the core, and compared with the shaft's speed. An option that only some methods have is for
    these. Points run in processes of this machine, or on a cluster.

    Ctrl-C ends the sweep; what is done is in --results, and the same command goes on from there. Exit status 1 if
    hardware and golden model differ. Needs the extra `sweep`.
    """
    earliest, late = delay("start", start or "0s"), delay("read_delay", read_delay)
    if axes is not None and plot is None:
        raise ValueError("--axes must be given together with --plot")
    check_machines(jobs, scheduler)
    grid = points_of(settings, methods, earliest, pick(engine).name if engine == "auto" else engine, late)
    across = {} if plot is None else _axes(axes, grid)
    inputs = [*([] if file is None else [file]), *settings.tables]
    Outputs({"--results": results, "--plot": plot}, inputs=inputs)
    columns = (*COLUMNS, "point", METRICS[metric][0])
    with Outputs({"--plot": plot}) as outputs:
        result = run_sweep(grid, columns, results, scheduler, jobs, progress_bar)
        if path := outputs.get("--plot"):
            _plot(path, result, across, metric)
    return 1 if print_sweep(result, results) else 0


def _plot(path: Path, result: SweepResult, across: dict[str, list[str]], metric: str) -> None:
    from tachometry.sim.plots.sweep import save_heat_maps  # Matplotlib is slow to import

    column, what, log = METRICS[metric]
    values, unit = result.columns[column], result.grid.unit
    if "{unit}" in what:
        what = what.format(unit=unit.name)
        values = [None if value is None else unit.of(value) for value in values]
    at = [result.grid.at[point] for point in result.columns["point"]]
    save_heat_maps(path, [*zip(result.columns["method"], at, values, strict=True)], across, what, log)


def _axes(text: str | None, grid: Points) -> dict[str, list[str]]:
    """Return axes of the heat map with their values: across, and upwards if there are two."""
    varied = {name: values for name, values in grid.axes.items() if len(values) > 1}
    if not varied:
        raise ValueError("--vary must be given together with --plot, with two values or more")
    if text is None:
        return dict(list(varied.items())[:2])
    names = [name.strip() for name in text.split(",")]
    if len(names) > 2 or len(set(names)) < len(names) or not set(names) <= set(varied):
        raise ValueError(f"--axes must be one or two of {', '.join(varied)}, not {text!r}")
    return {name: varied[name] for name in names}
