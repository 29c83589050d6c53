"""Table 1 of Rairán 2013: the lines themselves, at every ts, against `table1_rows`, and the flaw that they have."""

import math
from itertools import pairwise

import numpy as np
import pytest
from reference.rairan import table_1

from tachometry.sim.theory import rairan
from tachometry.sim.theory.table1 import table1_rows


@pytest.mark.parametrize("dt", [1, 2, 7, 20])
@pytest.mark.parametrize("rate", [0.02, 0.2, 0.7])
def test_events_are_the_lines_of_the_table(dt: int, rate: float) -> None:
    duration = 2000
    pulses = (np.flatnonzero(np.random.default_rng(dt).random(duration) < rate) + 1).tolist()
    lines = table_1([now in pulses for now in range(1, duration + 1)], dt)
    rows = table1_rows(pulses, dt, duration)
    held = {row.time: (row.c_ep, row.c_dt, row.n_ep1, row.n_dt1) for row in rows}
    now = held[0]
    for time, line in enumerate(lines, 1):
        now = held.get(time, now)
        assert now == (line.c_ep, line.c_dt, line.n_ep1, line.n_dt1), time
    assert {row.time for row in rows if row.pulse} == set(pulses)
    for before, row in pairwise(rows):
        assert row.new_n_dt1 or row.n_dt1 == before.n_dt1
        assert row.new_n_ep1 or row.n_ep1 == before.n_ep1


@pytest.mark.parametrize("first", [1, 300, 999, 1000, 1001, 1500])
def test_to_the_letter_it_locks_just_below_the_speed_limit(first: int) -> None:
    """dt = 1000 ts and a pulse every 1000.5: n1 = ½ for ever, half the speed, which n1 should never be below."""
    dt, n_pulses = 1000, 4000
    pulses = [first + math.ceil(1000.5 * k) for k in range(n_pulses)]
    rows = table1_rows(pulses, dt, pulses[-1])
    late = [row for row in rows if row.time > pulses[-1] // 2]
    assert {row.n1 for row in late} == {0.5}
    ratio = dt / 1000.5
    assert ratio == pytest.approx(0.9995, abs=1e-6)
    error = (ratio - 0.5) / ratio
    assert error > rairan.rairan_eq13_max_error(0.5)
    assert error == pytest.approx(0.49975, abs=1e-5)
