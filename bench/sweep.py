"""Points per second of `tachometry sweep`: part of docs/measured/bench.md."""

import argparse
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from pages import markdown, write_from

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.reports.terminal import print_table
from tachometry.cli.sweeping.points import points_of
from tachometry.cli.sweeping.settings import of_file
from tachometry.sim.studies.sweeping import cluster
from tachometry.sim.studies.sweeping.sweep import Point, run_point

FILE = Path(__file__).parents[1] / "docs" / "guides" / "sweep.toml"
COLUMNS = ["where", "points", "start", "points/s", "points/s of processor time"]

_HEADING = "## Sweeps"
_PAGE = """
These are the points of [sweep.toml](../guides/sweep.toml), 200 ms each by the golden model. They run one after
the other without Dask, and then in processes of `tachometry sweep`. The start lasts until the workers have connected;
each of them then imports numpy. The start is not included in points/s. Processor time includes all of it, and
that of the scheduler.

{table}"""


def all_points() -> dict[str, Point]:
    """Those of the file."""
    settings = of_file(FILE, by_name(sweep) | point_options())
    return points_of(settings, settings.fixed["methods"], 0.05, None).points


def measure(where: str, run: Callable[[], Iterable[object]]) -> list[str]:
    """The row of the table; the first thing that `run` gives is that it has begun, all others are points."""
    before, begun = _processor(), time.monotonic()
    arriving = iter(run())
    next(arriving)
    started = time.monotonic()
    n_points = sum(1 for _ in arriving)
    took, processor = time.monotonic() - started, _processor() - before
    return [
        where,
        str(n_points),
        f"{started - begun:.1f} s",
        f"{n_points / took:.0f}",
        f"{n_points / processor:.0f}",
    ]


def _processor() -> float:
    """Processor time in seconds, of this process and of those that it has begun and that have ended."""
    return time.process_time() + sum(os.times()[2:4])


def table(jobs: Iterable[int]) -> list[list[str]]:
    """All rows."""
    points = all_points()

    def plain() -> Iterable[object]:
        yield None
        yield from map(run_point, points.values())

    def processes(n: int) -> Iterable[object]:
        with cluster.cluster(None, n) as client:
            yield None
            yield from cluster.rows(client, points)

    rows = [measure("this process", plain)]
    return rows + [measure(f"`--jobs {n}`", lambda n=n: processes(n)) for n in jobs]  # type: ignore[misc]


def main() -> None:
    """Measure, print, and replace this part of the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page to which this part belongs, docs/measured/bench.md")
    output = parser.parse_args().output
    rows = table(sorted({1, os.cpu_count() or 1}))
    print_table(COLUMNS, rows)
    print()
    if output is not None:
        write_from(output, _HEADING, _PAGE.format(table=markdown(COLUMNS, rows)))


if __name__ == "__main__":
    main()
