"""Pages of the docs that the benchmarks write, and their tables."""

from collections.abc import Sequence
from pathlib import Path

from tachometry.sim.signals.files import replacing


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]], left: Sequence[int] = (0,)) -> str:
    """Return a table for a page, numbers to the right; `left` are the columns of words."""
    rules = ["---" if column in left else "---:" for column in range(len(columns))]
    return "".join(f"| {' | '.join(row)} |\n" for row in (columns, rules, *rows))


def write(page: Path, text: str) -> None:
    """Replace a page at once: a reader sees the old or the new one."""
    page.parent.mkdir(parents=True, exist_ok=True)
    with replacing(page) as beside:
        beside.write_text(text, encoding="utf-8")


def write_block(page: Path, name: str, part: str) -> None:
    """Replace what a page has between the marks `<!-- NAME -->` and `<!-- end of NAME -->`.

    It raises ValueError if the page does not have these marks once.
    """
    begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->\n"
    before, rest = page.read_text(encoding="utf-8").split(begin)
    _, after = rest.split(end)
    write(page, f"{before}{begin}{part}{end}{after}")
