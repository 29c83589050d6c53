"""docs/compare.md: its tables are those that its commands print now."""

import re
from typing import Any

import pytest
from support.script import load

page = load("compare")
DOCS = page.PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("situation", page.SITUATIONS, ids=lambda situation: situation.title)
def test_table_of_a_situation(situation: Any) -> None:
    """Methods that the page does not have yet may be in the table; those that it has must have these numbers."""
    _, part = DOCS.split(f"## {situation.title}\n")
    shown = part.split("\n## ")[0]
    assert " ".join(situation.command.split()) in " ".join(shown.replace("\\", "").split())
    expected = page.table(page.rows(situation.command)).splitlines()[2:]
    names = re.findall(r"^\| ([a-z][^ |]*) \|", shown, re.MULTILINE)[1:]
    assert len(names) >= 7
    rows = {line.split(" | ")[0].removeprefix("| "): line for line in expected}
    for name in names:
        assert rows[name] in shown, name
