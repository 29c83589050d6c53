import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.axes.rounds import Rounds
from tachometry.hdl.axes.turns import Turns


@pytest.mark.parametrize(("axes", "cycles"), [(1, 3), (2, 4), (3, 7), (8, 3)])
def test_each_axis_has_its_turn(axes: int, cycles: int) -> None:
    """Turns after reset, and of two ticks, the second as early as it may be and the third later."""
    whole = axes * cycles
    begins = [whole - 1, 2 * whole - 1, 3 * whole + 4]
    rows = [{"begin": int(clock in begins)} for clock in range(5 * whole)]
    seen = clock_by_clock(Turns(axes, cycles), rows, ["axis", "clears", "step"])
    starts = {0} | {clock + 1 for clock in begins}
    for clock, row in enumerate(seen):
        since = clock - max(start for start in starts if start <= clock)
        step = 1 << since % cycles if since < whole else 0
        assert row["step"] == step, clock
        assert not step or row["axis"] == since // cycles, clock
        assert row["clears"] == (clock < whole), clock


def test_what_an_upset_leaves_ends_with_the_next_tick() -> None:
    """A turn that has begun in the middle of nowhere, of an axis that is not the first."""
    early, begin, whole = 5, 11, 3 * 7
    rows = [{"begin": int(clock in (30 + early, 30 + begin))} for clock in range(90)]
    seen = clock_by_clock(Turns(3, 7), rows, ["axis", "step"])
    steps = [(row["axis"], row["step"]) for row in seen[31 + begin :]]
    assert steps[:whole] == [(clock // 7, 1 << clock % 7) for clock in range(whole)]
    assert not any(step for _, step in steps[whole:])


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
