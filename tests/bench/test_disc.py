"""The table of gains in docs/guides/disc.md, and the rows that bench/disc.py has measured for it."""

import pages
from support import docs
from support.nightly import nightly
from support.script import load

disc = load("disc")
ROWS = {(row["disc"], row["method"], row["motion"]): row for row in docs.table("disc")}


def test_the_guide_has_the_gains_that_were_measured() -> None:
    assert pages.block(disc.PAGE, "gains") == disc.gains()
    assert float(ROWS["off centre", "track", "50 rad/s"]["gain"]) > 0.8 * 850
    assert min(float(row["gain"]) for row in ROWS.values()) > 0.8


@nightly
def test_rows_are_measured_again() -> None:
    for row in disc.errors("real", "50 rad/s", 6):
        assert row == [*ROWS[tuple(row[:3])].values()]
