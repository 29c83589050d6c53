"""`tachometry loop`: a core in a velocity loop with a motor, and what the loop does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from tachometry.cli.files import Outputs
from tachometry.cli.options.loop_study import loop_options
from tachometry.cli.options.motion import FORMS
from tachometry.cli.options.option import option, output
from tachometry.cli.options.points import loops_of
from tachometry.cli.options.sweep import JOBS, SCHEDULER, VaryingCommand, check_machines
from tachometry.cli.options.sweep_settings import Settings
from tachometry.cli.reports.closed_loop import log_table, loop_table, print_loops
from tachometry.cli.reports.terminal import progress_bar
from tachometry.sim import build
from tachometry.sim.signals.files import write_csv
from tachometry.sim.studies.sweeping.grid import Loops
from tachometry.sim.studies.sweeping.run import LoopResult, run_loops
from tachometry.spec import AUTO

_VARY = """Option and its values: --vary kv=20,40. An option of core, controller, motor or encoder. LO..HI:N are N \
values, evenly spaced, LO..HI:Nlog are spaced by a factor. It may be given several times: all combinations are run."""
_METHODS = """Methods to run: auto, all, or names with commas between. auto chooses one as --method does. Names may \
have options, as in mt:timer=tick."""
_PLOT = "Figure of speed, error, current of the first seed. With several loops: the table, over the first axis."


@click.command(
    cls=VaryingCommand,
    points=loop_options,
    epilog=f"""{FORMS}

\b
Examples:
  tachometry loop --ppr 500 --motion ramp:0:40rad/s:1s+constant:40rad/s:2s \\
      --load 0.2Nm:2s:500ms --plot loop.png
  tachometry loop --ppr 500 --decoding 1 --tick 1ms --methods s,m,mt \\
      --motion constant:39rad/s:3s --from 1s --vary kv=20,30,40
  tachometry loop --ppr 500 --from 500ms \\
      --motion ramp:0:39rad/s:300ms+constant:39rad/s:1s \\
      --load 0.2Nm:800ms:200ms --phase-error 10 \\
      --vary tick=1ms,100us,20us --vary kv=40,80 --csv loops.csv""",
)
@option("Sweep", "--vary NAME=VALUES", multiple=True, help=_VARY)
@option("Sweep", "--methods LIST", default=AUTO, help=_METHODS)
@option("Sweep", "--seeds N", type=int, default=6, help="Runs of each loop, with seeds from --seed on.")
@JOBS
@SCHEDULER
@output("--plot", suffixes=(".png", ".pdf", ".svg"), help=_PLOT)
@output("--log", help="CSV of the first seed, a row every 100 µs. It needs a single loop.")
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
    """Simulate a velocity loop: a core, its motor and its controller.

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
    check_machines(jobs, scheduler)
    grid = loops_of(settings, methods, seeds)
    alone = len(grid.points) == 1 and scheduler is None
    if log is not None and not alone:
        raise ValueError("--log must be of one loop on this machine, without --vary, several --methods or --scheduler")
    across = "" if alone or plot is None else _across(grid)
    build.compiler()  # without one nothing is begun
    with Outputs({"--plot": plot, "--log": log, "--csv": csv}, inputs=settings.tables) as outputs:
        result = run_loops(grid, scheduler, jobs, progress_bar)
        if path := outputs.get("--log"):
            write_csv(path, *log_table(result.log))
        if path := outputs.get("--csv"):
            write_csv(path, *loop_table(result))
        if path := outputs.get("--plot"):
            _plot(path, result, across)
    print_loops(result)
    return 0


def _plot(path: Path, result: LoopResult, across: str) -> None:
    from tachometry.sim.plots.loop import save_log, save_loops  # Matplotlib is slow to import

    points, at = result.grid.points, result.grid.at
    if across:
        save_loops(path, [(points[digest].method, at[digest], row) for digest, row in result.rows.items()], across)
    else:
        save_log(path, next(iter(points.values())).setting, result.log)


def _across(grid: Loops) -> str:
    """Return the axis over which loops are drawn."""
    axes = [name for name, values in grid.axes.items() if len(values) > 1]
    if not axes:
        raise ValueError("--vary must be given together with --plot of several loops, with two values or more")
    return axes[0]
