"""The trip of the speed, clock by clock, and in cores against their golden model."""

import pytest
from proofs.source import mutant
from support.nightly import nightly
from support.simulate import clock_by_clock

from tachometry.hdl.output import over_speed


def check() -> None:
    """Every velocity of six bits, with and without its strobe."""
    rows = [
        {"velocity": velocity, "velocity_valid": valid, "clear": clear}
        for velocity in range(-32, 32)
        for valid, clear in ((0, 0), (1, 0), (0, 0), (0, 1), (0, 0), (1, 1), (0, 0))
    ]
    seen = clock_by_clock(over_speed.OverSpeed(20, 6), rows, ["over_speed"])
    tripped = 0
    for clock, row in enumerate(rows):
        assert seen[clock]["over_speed"] == tripped, (clock, row)
        tripped = int(not row["clear"] and (tripped or (row["velocity_valid"] and abs(row["velocity"]) > 20)))


def test_every_velocity() -> None:
    check()


@nightly  # it asks what the test above notices
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("> self._limit", ">= self._limit"),
        ("< -self._limit", "<= -self._limit"),
        ("self.velocity_valid & (above", "(above"),
    ],
)
def test_mutants_are_noticed(right: str, wrong: str) -> None:
    with mutant(over_speed.OverSpeed, right, wrong), pytest.raises(AssertionError):
        check()
