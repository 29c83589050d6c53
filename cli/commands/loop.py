"""`tachometry loop`: a core in a velocity loop with a motor, and what the loop does."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.closed_loop import loop_options
from tachometry.cli.options.motion import FORMS, tables_of
from tachometry.cli.options.option import option, output
from tachometry.cli.options.points import loops_of
from tachometry.cli.options.settings import Settings
from tachometry.cli.options.sweep import VaryingCommand
from tachometry.cli.reports.closed_loop import print_loop, print_loops, write_log, write_loops
from tachometry.cli.reports.streams import INTERRUPTED
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim.engines import build
from tachometry.sim.engines.loop import Log
from tachometry.sim.studies.loops.control import Outcome, each_seed, mean
from tachometry.sim.studies.sweeping.grid import Loops
from tachometry.sim.studies.sweeping.loops import LoopPoint, row_of
from tachometry.sim.studies.sweeping.sweep import Row
from tachometry.spec.language.units import plural


@click.command(
    cls=VaryingCommand,
    points=loop_options,
    epilog=f"""{FORMS}

\b
Examples:
  tachometry loop --ppr 500 --motion ramp:0:40:1s+constant:40:2s \\
      --load 0.2Nm:2s:500ms --plot loop.png
  tachometry loop --ppr 500 --decoding 1 --tick 1ms --methods s,m,mt \\
      --motion constant:39rad/s:3s --from 1s --vary kv=20,30,40
  tachometry loop --ppr 500 --motion ramp:0:39:300ms+constant:39:1s \\
      --from 500ms --load 0.2Nm:800ms:200ms --phase-error 10 \\
      --vary tick=1ms,100us,20us --vary kv=40,80 --csv loops.csv""",
)
@option(
    "Sweep",
    "--vary",
    multiple=True,
    metavar="NAME=VALUES",
    help="An axis: the name of an option of core, controller, motor or encoder, and its values with commas between. "
    "LO..HI:N stands for N values, evenly spaced, and LO..HI:Nlog for N whose logarithms are. It may be given several "
    "times: all combinations are run.",
)
@option(
    "Sweep",
    "--methods",
    default="s",
    metavar="LIST",
    help="Methods to run: all, or names with commas between, with options as in mt:timer=tick.",
)
@option("Sweep", "--seeds", type=int, default=6, metavar="N", help="Runs of each loop, with seeds from --seed on.")
@option(
    "Sweep",
    "--jobs",
    type=int,
    metavar="N",
    help="Number of runs at once on this machine. [default: one for each core]",
)
@option(
    "Sweep",
    "--scheduler",
    metavar="ADDRESS",
    help="Run on the workers of a Dask scheduler, such as tcp://host:8786, with the same version of tachometry. "
    "Whoever can connect to it can run code there and here, see docs/guides/sweep.md.",
)
@output(
    "--plot",
    suffixes=(".png", ".pdf"),
    help="Figure, .png or .pdf: speed, error and current of the run with the first seed, or of several loops what the "
    "table has, over the first axis.",
)
@output("--log", help="CSV of the run with the first seed of the only loop: a row every 100 µs.")
@output("--csv", help="CSV with a row per loop: the table.")
@click.pass_obj
def loop(
    settings: Settings,
    /,
    methods: str,
    seeds: int,
    jobs: int | None,
    scheduler: str | None,
    plot: Path | None,
    log: Path | None,
    csv: Path | None,
    **_: Any,
) -> int:
    """Close a velocity loop about a core, and tell what it does.

    Pins of the core see the encoder of a motor with friction, load and torque noise. Its velocity and position go to a
    controller with a disturbance observer (Tsuji 2009, Figs. 2 and 11), which commands the motor's current. Core,
    motor and controller run in one compiled program, the core clock by clock, the rest in double precision. --motion
    is the speed that is commanded, and its integral the angle. docs/concepts/control.md has the equations.

    The table has the RMS and the greatest error of the true speed, the dip under --load, the commanded current above
    50 Hz (what is heard), and the share of the time in which it is at its limit: means of all seeds, but the greatest
    error of all.

    Several methods, or axes with --vary, are run on all cores, which needs the extra `sweep`. Equal options give equal
    files. It needs a C++ compiler.
    """
    if jobs is not None and scheduler is not None:
        raise ValueError("--jobs must not be given together with --scheduler")
    if jobs is not None and jobs < 1:
        raise ValueError(f"--jobs must be at least 1, not {jobs}")
    found = loops_of(settings, methods, seeds)
    alone = len(found.points) == 1 and scheduler is None
    if log is not None and not alone:
        raise ValueError("--log must be of one loop on this machine, without --vary, several --methods or --scheduler")
    across = None if alone or plot is None else _across(found)
    files = {"--plot": plot, "--log": log, "--csv": csv}
    motions = settings.vary.get("motion") or [settings.fixed.get("motion")]
    inputs = [table for motion in motions if motion is not None for table in tables_of(motion)]
    build.compiler()  # without one nothing is begun
    with Outputs({name: path for name, path in files.items() if path is not None}, inputs=inputs) as outputs:
        begun = time.monotonic()
        if alone:
            ((digest, point),) = found.points.items()
            shown, outcomes = _alone(point, jobs)
            if (path := outputs.get("--log")) is not None:
                write_log(path, shown)
            rows = {digest: _mean(outcomes)}
        else:
            shown, outcomes = {}, []
            rows = _sweep(found, scheduler, jobs)
        if (path := outputs.get("--csv")) is not None:
            write_loops(path, found, rows)
        if (path := outputs.get("--plot")) is not None:
            from tachometry.sim.plots.loop import save_log, save_loops

            if across is None:
                save_log(path, next(iter(found.points.values())).setting, shown)
            else:
                names = {digest: point.method for digest, point in found.points.items()}
                save_loops(path, [(names[digest], found.at[digest], row) for digest, row in rows.items()], across)
        if alone:
            print_loop(point, outcomes)
        else:
            print_loops(found, rows, time.monotonic() - begun)
    return 0


def _alone(point: LoopPoint, jobs: int | None) -> tuple[Log, list[Outcome]]:
    """Return the log with the first seed, and what came of all."""
    first: Log = {}
    outcomes = []
    with progress_bar("running", len(point.seeds), "seeds") as report:
        for found in each_seed(point.setting, point.seeds, jobs):
            first = first or found
            outcomes.append(point.setting.outcome(found))
            report(len(outcomes))
    return first, outcomes


def _mean(outcomes: list[Outcome]) -> Row:

    return row_of(mean(outcomes))


def _sweep(found: Loops, scheduler: str | None, jobs: int | None) -> dict[str, Row]:
    """Return rows of all points, in their order."""
    from tachometry.sim.studies.sweeping import cluster

    cluster.require()
    rows: dict[str, Row] = {}
    try:
        with (
            cluster.cluster(scheduler, jobs) as client,
            progress_bar("running", len(found.points), "loops", rate=True) as report,
        ):
            for row in cluster.rows(client, found.points, "sweeping.loops"):
                rows[row["point"]] = row
                report(len(rows))
    except KeyboardInterrupt:
        click.echo(f"tachometry: interrupted after {len(rows)} of {plural(len(found.points), 'loop')}", err=True)
        raise click.exceptions.Exit(INTERRUPTED) from None
    return {digest: rows[digest] for digest in found.points}


def _across(found: Loops) -> str:
    """Return the axis over which loops are drawn."""
    varied = [name for name, values in found.axes.items() if len(values) > 1]
    if not varied:
        raise ValueError("--vary must be given together with --plot of several loops, with two values or more")
    return varied[0]
