"""Pages of the docs that the benchmarks write, their tables, and the hashes of what they show."""

import json
from collections.abc import Sequence
from pathlib import Path

from tachometry.sim.build import digest
from tachometry.sim.signals.files import replacing

ROOT = Path(__file__).resolve().parent.parent
STAMPS = ROOT / "docs" / "measured" / "made_of.json"


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Return a table for a page, numbers to the right; `left` are the columns of words."""
    rules = ["---" if column in left else "---:" for column in range(len(columns))]
    return "".join(f"| {' | '.join(row)} |\n" for row in (columns, rules, *rows))


def write(page: Path, text: str) -> None:
    """Replace a page at once: a reader sees the old or the new one."""
    page.parent.mkdir(parents=True, exist_ok=True)
    with replacing(page) as beside:
        beside.write_text(text, encoding="utf-8")


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


def stamp(file: Path, *parts: str) -> None:
    """Write the hashes of a file, or of parts of it, if the file is in `made_of.MADE_OF`."""
    if not file.resolve().is_relative_to(ROOT):
        return
    from made_of import MADE_OF

    if (name := file.resolve().relative_to(ROOT).as_posix()) in MADE_OF:
        stamps = json.loads(STAMPS.read_text(encoding="utf-8"))
        stamps |= {f"{name} {part}".strip(): hash_of(name, part) for part in parts or ("",)}
        write(STAMPS, json.dumps(stamps, indent=0, sort_keys=True) + "\n")
