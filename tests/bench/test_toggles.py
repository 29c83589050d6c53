"""bench/toggles.py counts what flip-flops do."""

import math

from support.script import load

from tachometry.spec import Encoder, MTachometer, Timing

toggles = load("toggles")


def test_a_position_that_counts_up() -> None:
    """A count in 10 clocks, from the third tick on: as many bits change as differ between numbers.

    The step is in a register as well, which is high for a clock. The 8th count shows in the third tick. In 17
    ticks other bits change than in 17 that begin a tick earlier or later.
    """
    spec = MTachometer(encoder=Encoder(100), timing=Timing(1_000_000, 40, 10))
    rad_per_s = 2 * math.pi * 1_000_000 / 10 / 400 * (1 + 1e-9)
    found = toggles.changes(spec, rad_per_s, 17)
    assert found["position_counter"] == sum((n ^ (n + 1)).bit_count() for n in range(7, 75)) + 2 * 68
    # A line changes in every second count.
    assert found["conditioner.sync_a"] + found["conditioner.sync_b"] == 2 * 68
