"""Pages of the docs that the benchmarks write: their tables, their data, and the hashes of what they show."""

import argparse
import csv
import json
import os
import re
import subprocess
import sys
import sysconfig
import tomllib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import StrictUndefined, Template

from tachometry.sim.build import digest
from tachometry.sim.signals.files import replacing

ROOT = Path(__file__).resolve().parent.parent
MEASURED = ROOT / "docs" / "measured"
STAMPS = MEASURED / "made_of.json"
Rows = Sequence[Sequence[str]]  # the first one is the heads
_MEASURED_AT = re.compile(r"\nLast measured at commit .*\n\Z")


def data(name: str) -> dict[str, Any]:
    """Return the contents of bench/NAME.toml."""
    return tomllib.loads((ROOT / "bench" / f"{name}.toml").read_text(encoding="utf-8"))


def filled(name: str, **holes: object) -> str:
    """Return bench/templates/NAME with its holes filled."""
    text = (ROOT / "bench" / "templates" / name).read_text(encoding="utf-8")
    return Template(text, undefined=StrictUndefined, keep_trailing_newline=True).render(**holes)


def tachometry(*words: object) -> str:
    """Run the command, with its errors shown; return its output. It raises CalledProcessError if it fails."""
    command = [f"{sysconfig.get_path('scripts')}/tachometry", *map(str, words)]
    return subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True, cwd=ROOT).stdout


def processor_time() -> float:
    """Return seconds that ended programs took which this one has run, whatever else the machine did meanwhile."""
    return sum(os.times()[2:4])


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Return a table for a page, numbers to the right; `left` are the columns of words."""
    rules = ["---" if column in left else "---:" for column in range(len(columns))]
    return "".join(f"| {' | '.join(row)} |\n" for row in (columns, rules, *rows))


def count(text: str) -> int:
    """Return a whole number of at least 1, for argparse."""
    if (number := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"must be at least 1, not {number}")
    return number


def measure(
    page: Path,
    blocks: Mapping[str, Callable[..., str | Rows]],
    words: Sequence[str] | None = None,
    usual: Sequence[str] = (),
    **numbers: int | None,
) -> None:
    """Measure blocks of a page (text), or tables beside it (rows), print and write them: the command of a script.

    `usual` are measured if none is named, or all; `numbers` are defaults of options that the blocks take.
    """
    parser = argparse.ArgumentParser(description=(sys.modules["__main__"].__doc__ or "").splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=blocks, default=usual or [*blocks], help="some of the tables")
    parser.add_argument("-o", "--output", type=Path, default=page, metavar="PAGE", help="page to change (%(default)s)")
    for name, default in numbers.items():
        parser.add_argument(f"--{name}", type=count, default=default, metavar="N", help="(%(default)s)")
    given = parser.parse_args(words)
    for name in given.only:
        made = blocks[name](**{number: getattr(given, number) for number in numbers})
        print(made if isinstance(made, str) else markdown(made[0], made[1:]), flush=True)
        if isinstance(made, str):
            write_block(given.output, name, made)
        else:
            write_table(given.output.parent / "tables" / f"{name}.csv", made)


def write(page: Path, text: str) -> None:
    """Replace a page at once: a reader sees the old or the new one."""
    page.parent.mkdir(parents=True, exist_ok=True)
    with replacing(page) as beside:
        beside.write_text(text, encoding="utf-8")


def read_table(file: Path) -> list[dict[str, str]]:
    """Return the rows of a table by their heads, without their commits."""
    with file.open(encoding="utf-8", newline="") as lines:
        return [{head: cell for head, cell in row.items() if head != "commit"} for row in csv.DictReader(lines)]


def write_table(file: Path, rows: Rows, merge: bool = False, parts: Sequence[str] = ()) -> None:
    """Write a table as CSV, each row with the commit it was measured at, and stamp it or its parts.

    `merge` keeps the rows of other names.
    """
    heads, *new = [[*rows[0], "commit"], *([*row, commit()] for row in rows[1:])]
    before = [*csv.reader(file.read_text(encoding="utf-8").splitlines())][1:] if merge else []
    names, places = {row[0] for row in new}, [row[0] for row in (*before, *new)]
    every = sorted([*(row for row in before if row[0] not in names), *new], key=lambda row: places.index(row[0]))
    file.parent.mkdir(parents=True, exist_ok=True)
    with replacing(file) as beside, beside.open("w", encoding="utf-8", newline="") as lines:
        csv.writer(lines, lineterminator="\n").writerows([heads, *every])
    stamp(file, *parts)


def block(page: Path, name: str) -> str:
    """Return the text between the marks `<!-- NAME -->` and `<!-- end of NAME -->`.

    It raises ValueError if the page does not have these marks once.
    """
    _, rest = page.read_text(encoding="utf-8").split(f"<!-- {name} -->\n")
    part, _ = rest.split(f"<!-- end of {name} -->\n")
    return part


def write_block(page: Path, name: str, part: str) -> None:
    """Replace a block of a page, see `block`, and stamp it."""
    begin = f"<!-- {name} -->\n"
    write(page, page.read_text(encoding="utf-8").replace(f"{begin}{block(page, name)}", f"{begin}{part}"))
    stamp(page, name)


def hash_of(file: str, part: str = "") -> str:
    """Return the hash of a sample of what a file in `made_of.MADE_OF` shows."""
    from made_of import MADE_OF  # it takes from all benchmarks, and they from here

    return digest(MADE_OF[file](part))[:16]


def commit() -> str:
    """Return the commit that is checked out; with a plus if a file of Python differs from it."""
    git = ["git", "-C", str(Path(__file__).parent)]
    done = subprocess.run([*git, "rev-parse", "--short=10", "HEAD"], capture_output=True, text=True)
    changed = subprocess.run([*git, "diff", "--quiet", "HEAD", "--", ":/*.py"], capture_output=True).returncode
    return (done.stdout.strip() or "unknown") + "+" * bool(changed)


def stamp(file: Path, *parts: str) -> None:
    """Put the commit at the end of a measured page, and keep the hashes of a file, or of its parts.

    Hashes are kept of the files in `made_of.MADE_OF`.
    """
    if not file.resolve().is_relative_to(ROOT):
        return
    if file.suffix == ".md" and file.resolve().is_relative_to(MEASURED):
        text = _MEASURED_AT.sub("", file.read_text(encoding="utf-8"))
        write(file, f"{text}\nLast measured at commit {commit()}.\n")
    from made_of import MADE_OF

    if (name := file.resolve().relative_to(ROOT).as_posix()) in MADE_OF:
        stamps = json.loads(STAMPS.read_text(encoding="utf-8"))
        stamps |= {f"{name} {part}".strip(): hash_of(name, part) for part in parts or ("",)}
        write(STAMPS, json.dumps(stamps, indent=0, sort_keys=True) + "\n")
