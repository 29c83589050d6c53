"""docs/guides/sweep.md says of every column, and shows the file that is there."""

import math
import re
import shlex

import click
from support import docs

from tachometry.cli.commands.sweep import sweep
from tachometry.cli.options.sweep import by_name, point_options
from tachometry.cli.sweeping.points import points_of
from tachometry.cli.sweeping.settings import of_command_line, of_file
from tachometry.sim.studies.sweeping.sweep import COLUMNS, run_point

DOCS = docs.DOCS / "guides"
PAGE = (DOCS / "sweep.md").read_text()


def test_every_column_is_told_with_its_unit() -> None:
    assert re.findall(r"^\| `(\w+)` \| (\w+) \| (.*) \|$", PAGE, re.MULTILINE) == [
        (name, *about) for name, about in COLUMNS.items()
    ]


def test_the_file_is_shown_as_it_is() -> None:
    assert f"```toml\n{(DOCS / 'sweep.toml').read_text()}```" in PAGE


def test_the_options_beside_it_mean_the_same() -> None:
    options = by_name(sweep) | point_options()
    command = re.search(r"^    tachometry sweep (--ppr(?:.*\\\n)*.*)$", PAGE, re.MULTILINE)
    assert command is not None
    words = shlex.split(command[1].replace("\\\n", ""))
    raw, _, _ = sweep.make_parser(click.Context(sweep)).parse_args(words)
    file = of_file(DOCS / "sweep.toml", options)
    for output in ("results", "plot"):
        del file.fixed[output]
    assert of_command_line(raw, options) == file


METHODS = ("s", "m:average=8", "mt")


def shown(values: list[float]) -> str:
    ends = (100 * min(values), 100 * max(values))
    low, high = (f"{end:#.2g}".rstrip(".") if end < 99 else f"{end:.0f}" for end in ends)
    return f"{low} to {high} %"


def test_how_far_off_the_methods_are_is_what_the_sweep_gives() -> None:
    settings = of_file(DOCS / "sweep.toml", by_name(sweep) | point_options())
    places: dict[float, dict[str, float]] = {}
    for point in points_of(settings, ",".join(METHODS), 0.05, None).points.values():
        row = run_point(point)
        counts = row["speed"] * row["tick_s"] * row["ppr"] * row["decoding"] / math.tau
        places.setdefault(round(counts, 9), {})[row["method"]] = row["relative_error"]
    assert len(places) == 80
    bands = {"below 0.3": (0, 0.3), "0.3 to 0.7": (0.3, 0.7), "0.7 to 1.2": (0.7, 1.2), "above 1.2": (1.2, math.inf)}
    for name, (low, high) in bands.items():
        here = [errors for counts, errors in places.items() if low <= counts < high]
        cells = [shown([errors[method] for errors in here]) for method in METHODS]
        worse = sum(errors["s"] > errors["m:average=8"] for errors in here)
        assert f"| {name} | {len(here)} | {' | '.join(cells)} | {worse} |" in PAGE
    worst = sorted(places, key=lambda counts: places[counts]["s"])[-4:]
    assert (round(min(worst), 2), round(max(worst), 2)) == (0.35, 0.42)
    assert sum(errors["s"] < errors["mt"] for counts, errors in places.items() if counts > 0.7) == 18
