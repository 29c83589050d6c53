"""Good encoders have no fault, and bad ones theirs in time; docs/measured/health.md has many runs of each."""

from pathlib import Path

import pages
import pytest
from support.nightly import nightly
from support.script import load

health = load("health")


@pytest.mark.parametrize("name", health.DISCS)
def test_good_encoders_have_no_fault(name: str) -> None:
    *_, indices, faults = health.clean(name, repeated=1)
    assert int(indices) == 26
    assert faults == "0"


@pytest.mark.parametrize("example", health.EXAMPLES, ids=lambda one: f"{one.option} {one.code}")
def test_each_fault_is_told_in_time(example: object) -> None:
    """A fault that is told too late, or another one, raises an error."""
    health.faulty(example, seeds=2)


@nightly
def test_the_page_is_up_to_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = health.PAGE.read_text("utf-8")
    monkeypatch.setattr(health, "PAGE", tmp_path / "health.md")
    before = [line for line in page.splitlines(keepends=True) if not line.startswith("| ")]
    health.PAGE.write_text("".join(before), "utf-8")
    for name, made in health.BLOCKS.items():
        pages.write_block(health.PAGE, name, made())
    assert health.PAGE.read_text("utf-8") == page
