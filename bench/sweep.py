"""Measures the errors of methods over speed and tick, for docs/measured/sweep.md."""

import math

from pages import MEASURED, ROOT, markdown, measure

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.points import points_of
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.options.sweep_settings import of_file
from tachometry.sim.studies.sweeping.sweep import Point, run_point

FILE = ROOT / "docs" / "guides" / "sweep.toml"
METHODS = ("s", "m:average=8", "mt")
# Counts per tick.
BANDS = {"below 0.3": (0, 0.3), "0.3 to 0.7": (0.3, 0.7), "0.7 to 1.2": (0.7, 1.2), "above 1.2": (1.2, math.inf)}


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


if __name__ == "__main__":
    measure(MEASURED / "sweep.md", {"errors": lambda: bands(errors())})
