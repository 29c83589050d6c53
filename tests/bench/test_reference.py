"""The reference pages are those of the code."""

import pytest
from support import docs
from support.script import load

DOCS = docs.DOCS / "reference"


@pytest.mark.parametrize("page", ["options", "ports", "registers", "boards", "columns", "functions"])
def test_pages_are_up_to_date(page: str) -> None:
    """If this fails, run `make docs`."""
    made = getattr(load("reference_pages"), page)()
    assert (DOCS / f"{page}.md").read_text(encoding="utf-8") == made
