"""All points of a grid are run, on this machine or on a cluster, with what has come of them as one result."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tachometry.sim.engines.loop import Log
from tachometry.sim.signals.progress import Bar
from tachometry.sim.studies.loops.control import Outcome, each_seed, mean
from tachometry.sim.studies.sweeping import cluster
from tachometry.sim.studies.sweeping.grid import Loops, Points
from tachometry.sim.studies.sweeping.loops import LoopPoint, row_of
from tachometry.sim.studies.sweeping.sweep import Point, Row
from tachometry.spec.language.units import plural


@dataclass(frozen=True)
class SweepResult:
    """Holds what has come of a sweep."""

    grid: Points
    columns: dict[str, list[Any]]  # those that were wanted, with a value for each point
    n_run: int  # points that were run; the others were in the file
    seconds: float


@dataclass(frozen=True)
class LoopResult:
    """Holds what has come of loops."""

    grid: Loops
    rows: dict[str, Row]  # the mean of the seeds, by the digest of the point
    seconds: float
    seeds: list[Row] = field(default_factory=list)  # a row for each seed of a loop that is alone
    log: Log = field(default_factory=dict)  # what happened in it with the first seed


def run_sweep(
    grid: Points, columns: Sequence[str], results: Path | None, scheduler: str | None, jobs: int | None, bar: Bar
) -> SweepResult:
    """Run the points that are not in the file of results yet, which then has all.

    At Ctrl-C KeyboardInterrupt says how far it has come. It raises OSError if the extra `sweep` is not there, or a file
    or the scheduler cannot be used.
    """
    cluster.require()
    from tachometry.sim.studies.sweeping.results import Results

    with Results(results, list(grid.points), grid.values) as kept:
        begun, missing, n_done = time.monotonic(), kept.missing, 0
        try:
            if missing:
                points = {point: grid.points[point] for point in missing}
                with _rows(points, "sweeping.sweep", "points", scheduler, jobs, bar) as rows:
                    for row in rows:
                        kept.add(row)
                        n_done += 1
        except (KeyboardInterrupt, cluster.LostScheduler) as error:
            n_kept = len(grid.points) - len(missing) + n_done
            where = f", kept in {results}" if results is not None and n_kept else ""
            how_far = f"after {n_kept} of {plural(len(grid.points), 'point')}{where}"
            if isinstance(error, KeyboardInterrupt):
                raise KeyboardInterrupt(how_far) from None
            raise OSError(f"{error} {how_far}: the same command goes on from there") from None
        return SweepResult(grid, kept.columns(*columns), len(missing), time.monotonic() - begun)


def run_loops(grid: Loops, scheduler: str | None, jobs: int | None, bar: Bar) -> LoopResult:
    """Run all loops, as `run_sweep` runs points; one that is alone runs in threads of this process."""
    begun = time.monotonic()
    if len(grid.points) == 1 and scheduler is None:
        ((digest, point),) = grid.points.items()
        log, outcomes = _run_alone(point, jobs, bar)
        return LoopResult(
            grid, {digest: row_of(mean(outcomes))}, time.monotonic() - begun, [row_of(one) for one in outcomes], log
        )
    cluster.require()
    found: dict[str, Row] = {}
    try:
        with _rows(grid.points, "sweeping.loops", "loops", scheduler, jobs, bar) as rows:
            for row in rows:
                found[row["point"]] = row
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"after {len(found)} of {plural(len(grid.points), 'loop')}") from None
    return LoopResult(grid, {digest: found[digest] for digest in grid.points}, time.monotonic() - begun)


def _run_alone(point: LoopPoint, jobs: int | None, bar: Bar) -> tuple[Log, list[Outcome]]:
    first: Log = {}
    outcomes: list[Outcome] = []
    with bar("running", len(point.seeds), "seeds") as report:
        for log in each_seed(point.setting, point.seeds, jobs):
            first = first or log
            outcomes.append(point.setting.outcome(log))
            report(len(outcomes))
    return first, outcomes


@contextmanager
def _rows(
    points: Mapping[str, Point | LoopPoint], study: str, unit: str, scheduler: str | None, jobs: int | None, bar: Bar
) -> Iterator[Iterator[Row]]:
    """Yield the rows of points as they come, while there are processes or workers to run them."""
    verb = "sweeping" if unit == "points" else "running"
    with cluster.cluster(scheduler, jobs) as client, bar(verb, len(points), unit, rate=True) as report:

        def counted() -> Iterator[Row]:
            for done, row in enumerate(cluster.rows(client, points, study), 1):
                yield row
                report(done)

        yield counted()
