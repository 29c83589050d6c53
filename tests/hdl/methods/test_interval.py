import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.methods.interval import IntervalAccumulator


def make(max_ticks: int = 4) -> IntervalAccumulator:
    return IntervalAccumulator(
        max_ticks=max_ticks, kept_ticks=max_ticks // 2, count_width=4, numerator_width=6, cancel=True
    )


def test_length_grows_and_keeps_its_newer_half() -> None:
    rows = []
    for k in range(16):
        rows += [{"tick": 1, "alteration": int(k in (2, 13))}, {"tick": 0}]
    seen = clock_by_clock(make(), rows, ["m_s", "update", "forced"])[::2]
    assert [row["m_s"] for row in seen] == [1, 2, 3, 1, 2, 3, 4, 3, 4, 3, 4, 3, 4, 3, 1, 2]
    assert [k for k, row in enumerate(seen) if row["update"]] == [2, 6, 8, 10, 12, 13]
    assert [k for k, row in enumerate(seen) if row["update"] and row["forced"]] == [6, 8, 10, 12]


def test_nothing_moves_without_a_tick() -> None:
    rows = [{"tick": 0, "alteration": 1, "m_e": 3, "previous": 2}] * 9
    seen = clock_by_clock(make(), rows, ["m_s", "update"])
    assert all(row == {"m_s": 1, "update": 0} for row in seen)


def test_numerator_is_the_sum_of_both_end_corrections() -> None:
    rows = [
        {"tick": 1, "alteration": 1, "m_e": -8, "previous": 7},
        {"alteration": 0, "m_e": 7, "previous": 7},
        {"alteration": 1, "m_e": -8, "previous": 7},
    ]
    seen = clock_by_clock(make(), rows, ["numerator"])
    assert [row["numerator"] for row in seen] == [0 - 7 - 15, -15, -30]


def test_bad_max_ticks() -> None:
    with pytest.raises(ValueError, match=r"^max_ticks must be at least 2, not 1$"):
        make(1)
