import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.sampling_clock import SamplingClock


@pytest.mark.parametrize("tick_cycles", [1, 2, 3, 4, 5, 8, 9, 960])
def test_last_is_high_in_the_last_clock_of_every_window(tick_cycles: int) -> None:
    seen = clock_by_clock(SamplingClock(tick_cycles), [{}] * (3 * tick_cycles + 1), ["last"])
    assert [row["last"] for row in seen] == [
        int(clock % tick_cycles == tick_cycles - 1) for clock in range(3 * tick_cycles + 1)
    ]


def test_bad_tick_cycles() -> None:
    with pytest.raises(ValueError, match=r"^tick_cycles must be at least 1, not 0$"):
        SamplingClock(0)
