import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.sampling_clock import SamplingClock


@pytest.mark.parametrize("tick_cycles", [1, 2, 3, 4, 5, 8, 9, 15, 16, 31, 32, 960, 4095, 4096])
def test_last_is_high_in_the_last_clock_of_every_window(tick_cycles: int) -> None:
    seen = clock_by_clock(SamplingClock(tick_cycles), [{}] * (3 * tick_cycles + 1), ["last"])
    assert [row["last"] for row in seen] == [
        int(clock % tick_cycles == tick_cycles - 1) for clock in range(3 * tick_cycles + 1)
    ]


@pytest.mark.parametrize("bits", range(5, 13))
def test_the_shift_register_goes_through_all_states_but_one(bits: int) -> None:
    """So whatever state it is in, the last one of a window comes; and of ones alone, which is its own, it is told."""
    ones = (1 << bits) - 1
    for tick_cycles in (1 << (bits - 1), ones):
        clock = SamplingClock(tick_cycles)
        assert sorted(clock.states) == list(range(ones))
        assert clock.states[-1] == ones >> 1
        assert [state for state in clock.states if state & ones >> 1 == ones >> 1] == [ones >> 1]
        del clock


def test_bad_tick_cycles() -> None:
    with pytest.raises(ValueError, match=r"^tick_cycles must be at least 1, not 0$"):
        SamplingClock(0)
