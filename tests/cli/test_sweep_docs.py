"""docs/sweep.md says of every column, and shows the file that is there."""

import re
from pathlib import Path

from tachometry.sim.sweep import COLUMNS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "sweep.md").read_text()


def test_every_column_is_told_with_its_unit() -> None:
    assert re.findall(r"^\| `(\w+)` \| (\w+) \| (.*) \|$", PAGE, re.MULTILINE) == [
        (name, *about) for name, about in COLUMNS.items()
    ]


def test_the_file_is_shown_as_it_is() -> None:
    assert f"```toml\n{(DOCS / 'sweep.toml').read_text()}```" in PAGE
