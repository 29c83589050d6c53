"""All methods and what others use, in several situations: writes docs/measured/compare.md.

First a table of all situations, with rivals tuned for each; then a table and a command for each of some.
"""

import argparse
import csv
import os
import re
import shlex
import tempfile
from dataclasses import dataclass
from pathlib import Path

import situations
from pages import MEASURED, count, data, filled, markdown, stamp, write

from tachometry.cli.main import main as tachometry

PAGE, FIGURE = MEASURED / "compare.md", MEASURED / "compare.png"
_DATA = data("compare")


@dataclass(frozen=True)
class Situation:
    """A comparison: its title, its remark, and the options of the command, those of the core first."""

    title: str
    text: str
    options: str
    core: str = _DATA["core"]

    @property
    def command(self) -> str:
        """The command whose table it is."""
        return f"tachometry compare {self.core} {self.options}"


SITUATIONS = tuple(Situation(**each) for each in _DATA["situation"])


def rows(command: str) -> list[dict[str, str]]:
    """Return the table of a command, by method."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.csv"
        try:
            tachometry([*shlex.split(command)[1:], "--csv", str(file)])
        except SystemExit as stop:
            if stop.code:
                raise
        with file.open(encoding="utf-8") as table:
            return list(csv.DictReader(table))


def table(found: list[dict[str, str]]) -> str:
    """Return the same in Markdown."""

    def cell(row: dict[str, str], name: str, scale: float = 1) -> str:
        return f"{scale * float(row[name]):.3g}" if row[name] else ""

    heads = ("method", "updates/s", "longest T_m (ms)", "RMS error (rad/s)", "greatest (rad/s)", "delay (ms)")
    numbers = (("updates_per_second", 1), ("worst_time", 1e3), ("rms_rad_s", 1), ("max_rad_s", 1), ("delay", 1e3))
    return markdown(heads, [(row["name"], *(cell(row, name, scale) for name, scale in numbers)) for row in found])


def section(situation: Situation) -> str:
    """Return a situation's part of the page."""
    options = situation.options.replace(" --motion", " \\\n        --motion")
    shown = f"    tachometry compare {situation.core} \\\n        {options}"
    return f"## {situation.title}\n\n{situation.text}\n\n{shown}\n\n{table(rows(situation.command))}"


def costs() -> str:
    """Return the command of the figure, which is drawn."""
    command = f"tachometry compare {_DATA['core']} {_DATA['costs']} --tradeoff docs/measured/{FIGURE.name}"
    rows(command.replace(f"docs/measured/{FIGURE.name}", shlex.quote(str(FIGURE))))
    return re.sub(" (?=--(methods|jitter|tradeoff))", " \\\\\n        ", command)


def page(n_seeds: int, jobs: int) -> str:
    """Return the page docs/measured/compare.md."""
    single, models = "\n".join(map(section, SITUATIONS)), situations.model_table()
    return filled("compare.md", costs=costs(), models=models, situations=single, **situations.parts(n_seeds, jobs))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=count, default=10, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("--jobs", type=count, default=os.cpu_count(), metavar="N", help="processes (%(default)s)")
    options = parser.parse_args()
    write(PAGE, page(options.seeds, options.jobs))
    stamp(PAGE)
    stamp(FIGURE)
