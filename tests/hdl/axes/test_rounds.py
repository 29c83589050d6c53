import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.axes.rounds import Rounds

OUTPUTS = ["slot", "first", "last", "ready"]


@pytest.mark.parametrize(("slots", "rounds"), [(3, 1), (3, 2), (5, 4), (8, 7)])
def test_slots_and_rounds(slots: int, rounds: int) -> None:
    seen = clock_by_clock(Rounds(slots, rounds, 3), [{}] * (slots * (2 * rounds + 5)), OUTPUTS)
    for clock, row in enumerate(seen):
        round_ = clock // slots
        assert row == {
            "slot": clock % slots,
            "first": round_ % rounds == 0,
            "last": round_ % rounds == rounds - 1,
            "ready": round_ >= 3,
        }, clock
