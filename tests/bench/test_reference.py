"""The reference pages are those of the code."""

import re

import pytest
from support import docs
from support.script import load

DOCS = docs.DOCS / "reference"


@pytest.mark.parametrize("page", ["options", "ports", "registers", "boards", "columns", "functions"])
def test_pages_are_up_to_date(page: str) -> None:
    """If this fails, run `make docs`."""
    made = getattr(load("reference_pages"), page)()
    assert (DOCS / f"{page}.md").read_text(encoding="utf-8") == made


def test_the_page_of_choices_names_options_of_generate() -> None:
    page, options = docs.page("guides/integration.md"), docs.page("reference/options.md")
    named = set(re.findall(r"`(--[\w-]+)", page))
    assert len(named) >= 15
    assert [name for name in named if f"`{name}" not in options] == []
