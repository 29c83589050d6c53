"""Measures the errors of methods over speed and tick, and points per second of a sweep: docs/measured/sweep.md."""

import argparse
import math
import os
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from pages import markdown, write_block

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.points import points_of
from tachometry.cli.options.settings import of_file
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.reports.terminal import print_table
from tachometry.sim.studies.sweeping import cluster
from tachometry.sim.studies.sweeping.sweep import Point, run_point

FILE = Path(__file__).parents[1] / "docs" / "guides" / "sweep.toml"
METHODS = ("s", "m:average=8", "mt")
# Counts per tick.
BANDS = {"below 0.3": (0, 0.3), "0.3 to 0.7": (0.3, 0.7), "0.7 to 1.2": (0.7, 1.2), "above 1.2": (1.2, math.inf)}
COLUMNS = ["where", "points", "start", "points/s", "points/s of processor time"]


def all_points() -> dict[str, Point]:
    """Return those of the file."""
    settings = of_file(FILE, by_name(sweep) | point_options())
    return points_of(settings, settings.fixed["methods"], 0.05, None).points


def errors() -> dict[float, dict[str, float]]:
    """Return relative errors of the methods at each number of counts per tick."""
    places: dict[float, dict[str, float]] = {}
    settings = of_file(FILE, by_name(sweep) | point_options())
    for point in points_of(settings, ",".join(METHODS), 0.05, None).points.values():
        row = run_point(point)
        counts = row["speed"] * row["tick_s"] * row["ppr"] * row["decoding"] / math.tau
        places.setdefault(round(counts, 9), {})[row["method"]] = row["relative_error"]
    return places


def _shown(values: list[float]) -> str:
    ends = (100 * min(values), 100 * max(values))
    low, high = (f"{end:#.2g}".rstrip(".") if end < 99 else f"{end:.0f}" for end in ends)
    return f"{low} to {high} %"


def bands(places: dict[float, dict[str, float]]) -> str:
    """Return a row for each range of counts per tick."""
    rows = []
    for name, (low, high) in BANDS.items():
        here = [found for counts, found in places.items() if low <= counts < high]
        cells = [_shown([found[method] for found in here]) for method in METHODS]
        rows.append([name, str(len(here)), *cells, str(sum(one["s"] > one["m:average=8"] for one in here))])
    return markdown(["counts per tick", "points", *METHODS, "s worse than m"], rows)


def measure(where: str, run: Callable[[], Iterable[object]]) -> list[str]:
    """Return the row of the table; the first thing that `run` gives is that it has begun, all others are points."""
    before, begun = _processor(), time.monotonic()
    arriving = iter(run())
    next(arriving)
    started = time.monotonic()
    n_points = sum(1 for _ in arriving)
    took, processor = time.monotonic() - started, _processor() - before
    return [where, str(n_points), f"{started - begun:.1f} s", f"{n_points / took:.0f}", f"{n_points / processor:.0f}"]


def _processor() -> float:
    """Return processor time in seconds, of this process and of those that it has begun and that have ended."""
    return time.process_time() + sum(os.times()[2:4])


def table(jobs: Iterable[int]) -> list[list[str]]:
    """Return all rows."""
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
    """Measure, print, and replace the tables of the page if asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, help="page whose tables are replaced")
    output = parser.parse_args().output
    by_speed = bands(errors())
    print(by_speed)
    rows = table(sorted({1, os.cpu_count() or 1}))
    print_table(COLUMNS, rows)
    print()
    if output is not None:
        write_block(output, "errors", by_speed)
        write_block(output, "speeds", markdown(COLUMNS, rows))


if __name__ == "__main__":
    main()
