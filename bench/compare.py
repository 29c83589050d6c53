"""All methods and what others use, in several situations: writes docs/measured/compare.md.

Its tables are CSV beside it: all situations, with rivals tuned for each, and single commands.
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
from pages import MEASURED, count, data, read_table, stamp, write_block, write_table

from tachometry.cli.main import main as tachometry

PAGE, FIGURE, TABLES = MEASURED / "compare.md", MEASURED / "compare.png", MEASURED / "tables"
HEADS = ("method", "updates/s", "longest T_m (ms)", "RMS error (rad/s)", "greatest (rad/s)", "delay (ms)")
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
        """The command that prints its table."""
        return f"tachometry compare {self.core} {self.options}"


COSTS = f"tachometry compare {_DATA['core']} {_DATA['costs']} --tradeoff docs/measured/{FIGURE.name}"
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


def table(found: list[dict[str, str]]) -> list[list[str]]:
    """Return the same, rounded."""

    def cell(row: dict[str, str], name: str, scale: float = 1) -> str:
        return f"{scale * float(row[name]):.3g}" if row[name] else ""

    numbers = (("updates_per_second", 1), ("worst_time", 1e3), ("rms_rad_s", 1), ("max_rad_s", 1), ("delay", 1e3))
    return [[row["name"], *(cell(row, name, scale) for name, scale in numbers)] for row in found]


def code(command: str) -> str:
    """Return a command as the page shows it."""
    return re.sub(" (?=--(methods|motion|jitter|tradeoff))", " \\\\\n        ", f"\n    {command}\n\n")


def errors_of(name: str) -> dict[str, list[float]]:
    """Return the mean errors of a table, by situation."""
    rows = read_table(TABLES / f"{name}.csv")
    return {row.pop("situation"): [float(cell.split()[0]) for cell in row.values()] for row in rows}


def blocks() -> dict[str, str]:
    """Return the blocks of docs/measured/compare.md from the tables."""
    return {
        "verdict": situations.verdict(errors_of("compare")),
        "models": situations.model_table(),
        "costs": code(COSTS),
        "situations": "".join(f"### {one.title}\n\n{one.text}\n{code(one.command)}" for one in SITUATIONS),
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=count, default=10, metavar="N", help="seeds of what is random (%(default)s)")
    parser.add_argument("--jobs", type=count, default=os.cpu_count(), metavar="N", help="processes (%(default)s)")
    options = parser.parse_args()
    rows(COSTS.replace(f"docs/measured/{FIGURE.name}", shlex.quote(str(FIGURE))))
    stamp(FIGURE)
    single = [["situation", *HEADS], *([one.title, *row] for one in SITUATIONS for row in table(rows(one.command)))]
    for name, made in (situations.tables(options.seeds, options.jobs) | {"single": single}).items():
        write_table(TABLES / f"{name}.csv", made)
    for name, text in blocks().items():
        write_block(PAGE, name, text)
