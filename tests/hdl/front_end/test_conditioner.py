import itertools

import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.conditioner import InputConditioner


def test_a_level_is_out_after_the_synchroniser() -> None:
    seen = clock_by_clock(
        InputConditioner(), [{"a": 0, "b": 1}] * 4 + [{"a": 1}] + [{}] * 4, ["level_a", "level_b", "ready_a", "ready_b"]
    )
    latency = 2
    assert [row["level_a"] for row in seen] == [0] * (4 + latency) + [1] * (5 - latency)
    assert [row["level_b"] for row in seen] == [0] * latency + [1] * (9 - latency)


@pytest.mark.parametrize(("a", "b"), list(itertools.product((0, 1), repeat=2)))
def test_ready_only_when_the_level_and_the_one_before_are_real(a: int, b: int) -> None:
    seen = clock_by_clock(InputConditioner(), [{"a": a, "b": b}] * 8, ["level_a", "level_b", "ready_a", "ready_b"])
    assert [(row["ready_a"], row["ready_b"]) for row in seen] == [(0, 0)] * 3 + [(1, 1)] * 5
    assert all((row["level_a"], row["level_b"]) == (a, b) for row in seen[2:])
