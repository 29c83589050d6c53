"""Good encoders have no fault, and bad ones theirs in time; docs/measured/health.md has many runs of each."""

import pytest
from support import docs
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
@pytest.mark.parametrize("name", health.BLOCKS)
def test_table_is_up_to_date(name: str) -> None:
    heads, *rows = health.BLOCKS[name]()
    assert [dict(zip(heads, row, strict=True)) for row in rows] == docs.table(name)
