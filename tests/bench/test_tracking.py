"""docs/measured/tables/tracking.csv: its rows are what is measured now, and what is promised of them holds."""

import pytest
from support import docs
from support.script import load

tracking = load("tracking")
ROWS = {name: cells for name, *cells in (row.values() for row in docs.table("tracking"))}
# RMS in rad/s with ticks of 20 us and a real disc.
LIMITS = {
    "ramp, real": 0.004, "slow, real": 2e-4, "fast, real": 6e-4, "reversals, real": 0.17, "slow sine, real": 0.06,
    "fast sine, real": 1.7, "gentle S-curve": 0.2,
}  # fmt: skip


def error(name: str, column: int) -> float:
    return float(ROWS[name][column].split(" ")[0])


@pytest.mark.parametrize("name", [one.name for one in tracking.SITUATIONS if not one.random])
def test_rows_are_those_of_today(name: str) -> None:
    """The columns of the core; those in float change with it only where the rules do."""
    (situation,) = [one for one in tracking.SITUATIONS if one.name == name]
    found = tracking.row(situation, 1, beside=False)[1:]
    assert [found[column] for column in (0, 2, 3, 5)] == [ROWS[name][column] for column in (0, 2, 3, 5)]


@pytest.mark.parametrize("column", [0, 3])
def test_errors_are_at_most_a_tenth_above_those_in_float(column: int) -> None:
    """Where the disc is ideal and the speed constant, only rounding is left."""
    names = [one.name for one in (*tracking.SITUATIONS, *tracking.OTHERS)]
    assert {name for name in names if error(name, column) > 1.1 * error(name, column + 1)} == {"very slow", "fast"}


def test_errors_with_a_real_disc_are_within_their_limits() -> None:
    assert [name for name, limit in LIMITS.items() if error(name, 3) > limit] == []


# With an ideal disc only rounding is left, or what the parabola leaves; of a vibration no count tells, and a shaft that
# has stopped is not known to have. docs/concepts/track.md has more of each.
TOO_LARGE = {
    "ramp", "very slow", "fast", "fast, real", "fast, bad", "slow sine", "fast sine", "trapezoid", "rest on an edge",
    "stop", "triangle", "stick-slip", "jogs", "coast to rest", "lost pulses", "lost pulses, ramp", "coarse disc, slow",
}  # fmt: skip
TOO_SMALL = {
    "ramp, bad", "unit velocity, vibration", "unit velocity, vibration, real", "ripple of 0.3 %", "eccentric disc",
    "fine disc, very slow",
}  # fmt: skip


@pytest.mark.parametrize("column", [2, 5])
def test_quality_covers_two_errors_of_three(column: int) -> None:
    shares = {name: float(cells[column]) for name, cells in ROWS.items()}
    assert {name for name, share in shares.items() if share > 78} <= TOO_LARGE
    assert {name for name, share in shares.items() if share < 58} <= TOO_SMALL
