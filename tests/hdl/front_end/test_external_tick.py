"""Ticks from outside: windows between rises, neither too short nor too long."""

import numpy as np
import pytest
from support.simulate import Resettable, clock_by_clock

from tachometry.hdl.front_end.external_tick import ExternalTick
from tachometry.sim.golden.sampling import external_windows


def ends(rises: list[int], n_clocks: int, min_cycles: int, max_cycles: int) -> tuple[list[int], list[int]]:
    """Return last clocks of windows and clocks with an error; a rise is given by the clock in which it is seen."""
    level = np.isin(np.arange(n_clocks) + 2, rises).astype(int).tolist()
    seen = clock_by_clock(
        ExternalTick(min_cycles, max_cycles), [{"tick_in": high} for high in level], ["last", "tick_error"]
    )
    last, error = ([k for k, row in enumerate(seen) if row[name]] for name in ("last", "tick_error"))
    return last, [k - 2 for k in error]


def check(rises: list[int], last: list[int], errors: list[int], min_cycles: int = 5, max_cycles: int = 20) -> None:
    golden = external_windows(np.array(rises), last[-1] + 1, min_cycles, max_cycles)
    assert (golden[0].tolist(), golden[1].tolist()) == (last, errors)
    got = ends(rises, last[-1] + 3, min_cycles, max_cycles)
    assert ([k for k in got[0] if k <= last[-1]], got[1]) == (last, errors)


def test_windows() -> None:
    check([9, 19, 31], [9, 19, 31], [])
    check([9, 13, 19], [9, 19], [13])  # four clocks are too few
    check([9, 14, 19], [9, 14, 19], [])  # five are not
    check([4, 24, 45], [4, 24, 44], [44])  # the watchdog is a clock earlier than the rise, which is then too early
    check([4, 24, 44], [4, 24, 44], [])
    check([3, 23], [19, 39], [3, 19, 23, 39])
    check([], [19, 39, 59], [19, 39, 59])
    check([3, 5, 8, 10], [3, 5, 8, 10], [], min_cycles=2)
    check([7, 14], [3, 7, 11, 14], [3, 11], min_cycles=2, max_cycles=4)


@pytest.mark.parametrize("seed", range(5))
def test_random_ticks(seed: int) -> None:
    rng = np.random.default_rng(seed)
    min_cycles = int(rng.integers(2, 9))
    max_cycles = int(rng.integers(min_cycles, 20))
    rises = np.cumsum(rng.integers(2, 2 + int(rng.integers(2, 2 * max_cycles)), 300)) + 1
    n_clocks = int(rises[-1])
    last, errors = external_windows(rises, n_clocks, min_cycles, max_cycles)
    got = ends(rises.tolist(), n_clocks + 2, min_cycles, max_cycles)
    assert [k for k in got[0] if k < n_clocks] == last.tolist()
    assert [k for k in got[1] if k < n_clocks] == errors.tolist()


def test_a_line_that_rests_high_has_not_risen() -> None:
    seen = clock_by_clock(ExternalTick(2, 20), [{"tick_in": 1}] * 15, ["last", "tick_error"])
    assert not any(row["last"] or row["tick_error"] for row in seen)


def test_a_rise_before_reset_is_released_is_none() -> None:
    """The synchroniser has no reset: what it holds then is not a level of this run."""
    rows = [{"rst": clock < 30, "tick_in": clock in (20, 27, 28, 29, 40)} for clock in range(60)]
    seen = clock_by_clock(Resettable(ExternalTick(2, 1000)), rows, ["last"])
    assert [clock for clock, row in enumerate(seen) if row["last"] and clock >= 30] == [42]
