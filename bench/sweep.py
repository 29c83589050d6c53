"""Measures the errors of methods over speed and tick, and points per second of a sweep: docs/measured/sweep.md."""

import math
import os
import time
from collections.abc import Callable, Iterable

from pages import MEASURED, ROOT, markdown, measure

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.points import points_of
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.options.sweep_settings import of_file
from tachometry.sim.studies.sweeping import cluster
from tachometry.sim.studies.sweeping.sweep import Point, run_point

FILE = ROOT / "docs" / "guides" / "sweep.toml"
METHODS = ("s", "m:average=8", "mt")
# Counts per tick.
BANDS = {"below 0.3": (0, 0.3), "0.3 to 0.7": (0.3, 0.7), "0.7 to 1.2": (0.7, 1.2), "above 1.2": (1.2, math.inf)}
COLUMNS = ["where", "points", "start", "points/s", "points/s of processor time"]


def all_points(methods: str = "") -> dict[str, Point]:
    """Return the points of the file, of its methods unless others are named."""
    settings = of_file(FILE, by_name(sweep) | point_options())
    return points_of(settings, methods or settings.fixed["methods"], 0.05, None).points


def errors() -> dict[float, dict[str, float]]:
    """Return relative errors of the methods at each number of counts per tick."""
    places: dict[float, dict[str, float]] = {}
    for point in all_points(",".join(METHODS)).values():
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


def timed(where: str, run: Callable[[], Iterable[object]]) -> list[str]:
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

    rows = [timed("this process", plain)]
    return rows + [timed(f"`--jobs {n}`", lambda n=n: processes(n)) for n in jobs]  # type: ignore[misc]


BLOCKS = {
    "errors": lambda: bands(errors()),
    "speeds": lambda: markdown(COLUMNS, table(sorted({1, os.cpu_count() or 1}))),
}

if __name__ == "__main__":
    measure(MEASURED / "sweep.md", BLOCKS)
