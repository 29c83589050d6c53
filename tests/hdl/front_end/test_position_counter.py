import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.position_counter import PositionCounter


def test_adds_up_steps_and_wraps_both_ways() -> None:
    steps = [1] * 9 + [0] + [-1] * 19 + [0] * 2
    seen = clock_by_clock(PositionCounter(4), [{"step": step} for step in steps], ["position"])
    total, wanted = 0, [0, 0]
    for step in steps:
        total += step
        wanted.append((total + 8) % 16 - 8)
    assert [row["position"] for row in seen] == wanted[: len(steps)]


def test_bad_width() -> None:
    with pytest.raises(ValueError, match=r"^width must be at least 2, not 1$"):
        PositionCounter(1)
