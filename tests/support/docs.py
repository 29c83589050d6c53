"""Pages of the documentation, for the tests that hold them against the product."""

import csv
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def page(name: str) -> str:
    """Return the text of a page by its path in docs/."""
    return (DOCS / name).read_text(encoding="utf-8")


def table(name: str, folder: str = "measured/tables") -> list[dict[str, str]]:
    """Return the rows of a table of the documentation by their heads, without their commits."""
    rows = csv.DictReader(page(f"{folder}/{name}.csv").splitlines())
    return [{head: cell for head, cell in row.items() if head != "commit"} for row in rows]
