"""Counters of three axes with four slots, in a round that is followed level by level."""

import numpy as np
from support.simulate import clock_by_clock

from tachometry.hdl.axes.axis_counters import AxisCounters

AXES, SLOTS, ROUNDS, TICKS = 3, 4, 5, 12
PHASE = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}
OUTPUTS = ["axis", "step", "decode_error", "complete", "count"]


def test_every_axis_counts_its_own_lines() -> None:
    rng = np.random.default_rng(3)
    n_rounds = ROUNDS * TICKS
    level = rng.integers(0, 2, (2, AXES, n_rounds))
    rows = []
    for clock in range(n_rounds * SLOTS):
        round_, slot = divmod(clock, SLOTS)
        a, b = level[:, slot, round_] if slot < AXES else (0, 0)
        rows.append(
            {
                "slot": slot,
                "first": int(round_ % ROUNDS == 0),
                "last": int(round_ % ROUNDS == ROUNDS - 1),
                "ready": int(round_ >= 3),
                "level_a": int(a),
                "level_b": int(b),
            }
        )
    seen = clock_by_clock(AxisCounters(slots=SLOTS, rounds=ROUNDS, decoding=4), rows, OUTPUTS)
    counts = [0] * AXES
    for clock, row in enumerate(seen[3:]):
        round_, slot = divmod(clock, SLOTS)
        assert row["axis"] == slot
        assert row["complete"] == (round_ % ROUNDS == ROUNDS - 1)
        if slot == AXES:
            assert row["step"] == row["decode_error"] == row["count"] == 0
            continue
        turned = 0
        if round_ >= 3:
            past, new = (PHASE[tuple(level[:, slot, at].tolist())] for at in (round_ - 1, round_))
            turned = (new - past) % 4
        step = {0: 0, 1: 1, 2: 0, 3: -1}[turned]
        counts[slot] = step if round_ % ROUNDS == 0 else counts[slot] + step
        assert (row["step"], row["decode_error"], row["count"]) == (step, turned == 2, counts[slot]), (round_, slot)
