"""Tables of the benchmarks, on the terminal and in the pages of the docs that they write."""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table


def markdown(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table for a page."""
    lines = [columns, ["---", *["---:"] * (len(columns) - 1)], *rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in lines)


def show(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """The same on the terminal."""
    table = Table(box=None, header_style="")
    for column in columns:
        table.add_column(column, justify="left" if column == columns[0] else "right")
    for row in rows:
        table.add_row(*row)
    console = Console()
    console.print(table)
    console.print()


def write(page: Path, text: str) -> None:
    """Replace a page at once: a reader sees the old or the new one."""
    page.parent.mkdir(parents=True, exist_ok=True)
    beside = page.with_name(f".{page.name}.new")
    beside.write_text(text, encoding="utf-8")
    beside.replace(page)


def write_from(page: Path, heading: str, part: str) -> None:
    """Replace a page from a heading on, or put it at the end."""
    before = page.read_text(encoding="utf-8").split(f"\n{heading}\n")[0] if page.exists() else "# Speed\n"
    write(page, f"{before}\n{heading}\n{part}")
