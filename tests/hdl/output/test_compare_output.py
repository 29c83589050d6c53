"""The compare output against its rules, clock by clock."""

import numpy as np
import pytest
from proofs.source import mutant
from support.nightly import nightly, only
from support.simulate import clock_by_clock

from tachometry.hdl.output import compare_output
from tachometry.spec.core.compare import Compare

SEEN = ["compare", "compare_valid", "compare_position", "compare_count"]
CASES = [
    (Compare(2, 3, 0, "4clk"), 4),
    (Compare(-4, 1, 5, "1clk"), 1),
    (Compare(5, 2, 3, "9clk", backward=True), 9),
    (Compare(-7, 15, 0, "2clk", backward=True), 2),
]
WIDTH = 5


def check(case: tuple[Compare, int], seed: int) -> None:
    """Walk to and fro over all positions of five bits, with steps in clocks side by side and far apart."""
    compare, clocks = case
    rng = np.random.default_rng(seed)
    position, way, rows = 0, 1, []
    for _ in range(900):
        way = way if rng.random() < 0.95 else -way
        step = int(way * (rng.random() < 0.6))
        position = (position + step + 16) % 32 - 16
        rows.append({"step": step, "position": position})
    seen = clock_by_clock(compare_output.CompareOutput(compare, clocks, WIDTH), rows, SEEN)
    awaited, begun = compare.start, list[int]()
    wanted = dict.fromkeys(SEEN, 0)
    for clock, row in enumerate(rows):
        wanted["compare"] = int(bool(begun) and clock - begun[-1] < clocks)
        wanted["compare_valid"] = int(bool(begun) and clock == begun[-1])
        assert seen[clock] == wanted, (case, seed, clock)
        more = not compare.count or len(begun) < compare.count
        if more and row["step"] == (-1 if compare.backward else 1) and row["position"] == awaited:
            begun.append(clock + 1)
            wanted |= {"compare_position": awaited, "compare_count": len(begun)}
            awaited = (awaited + (-compare.step if compare.backward else compare.step) + 16) % 32 - 16
    assert len(begun) == compare.count or len(begun) > 5


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", only([0], range(5)))  # 900 clocks meet all positions
def test_every_clock_is_as_the_rules_say(case: tuple[Compare, int], seed: int) -> None:
    check(case, seed)


def check_all() -> None:
    for case in CASES:
        check(case, 0)


@nightly  # it asks what the test above notices
@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.step[0] & ", ""),
        ("(self.step[1] == compare.backward) & ", ""),
        ("self.compare_count != compare.count", "self.compare_count != compare.count + 1"),
        ("left.eq(left - 1)", "left.eq(left >> 1)"),
        ("left.eq(self._clocks)", "left.eq(self._clocks - 1)"),
        ("awaited.eq(awaited + compare.apart)", "awaited.eq(awaited + compare.step)"),
        ("self.compare_position.eq(awaited)", "self.compare_position.eq(compare.start)"),
    ],
)
def test_mutants_are_noticed(right: str, wrong: str) -> None:
    with mutant(compare_output.CompareOutput, right, wrong), pytest.raises(AssertionError):
        check_all()
