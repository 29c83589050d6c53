"""Pages of the documentation, for the tests that hold them against the product."""

from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def page(name: str) -> str:
    """Return the text of a page by its path in docs/."""
    return (DOCS / name).read_text(encoding="utf-8")
