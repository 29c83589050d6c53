"""Reciprocals of every m, when they are due, and held."""

import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic.reciprocal import DividedReciprocal, LookedUpReciprocal
from tachometry.spec.formats import reciprocal as spec


@pytest.mark.parametrize("max_m", [2, 3, 64, 65])
def test_every_reciprocal_two_clocks_after_m(max_m: int) -> None:
    described = spec.Reciprocal(max_m, max_numerator=28, frac_bits=8, halvings=1)
    rows = [{"m": m} for m in range(1, max_m + 1)] + [{}, {}]
    seen = [row["q"] for row in clock_by_clock(LookedUpReciprocal(described), rows, ["q"])]
    assert seen[2:] == [described.value(m) for m in range(1, max_m + 1)]


@pytest.mark.parametrize("max_m", [2, 13, 32])
def test_every_division(max_m: int) -> None:
    """From the reset on, and then from each move on; a move in the midst of a division begins anew."""
    described = spec.DividedReciprocal(max_m, max_numerator=7, frac_bits=4, halvings=1)
    clocks = described.steps + 2
    rows: list[dict[str, int]] = [{"m": 1, "moves": 0}] * (clocks - 1)
    for m in range(1, max_m + 1):
        rows += [{"moves": 1}, *[{"m": m, "moves": 0}] * (clocks - 1)]
        if m % 5 == 0:
            rows += [{"moves": 1}, *[{"m": 1, "moves": 0}] * 3]
    seen = clock_by_clock(DividedReciprocal(described), [*rows, {}, {}], ["q"])
    moves = [0, *(clock for clock, row in enumerate(rows) if row["moves"])]
    held = 0
    for before, after in zip(moves, [*moves[1:], len(rows)], strict=True):
        for clock in range(before + clocks - (before == 0), after + 1):
            assert seen[clock]["q"] == described.value(rows[clock - 1]["m"]), clock
            held += 1
    assert held > max_m
