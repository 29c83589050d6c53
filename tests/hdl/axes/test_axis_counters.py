"""Counters of three axes with four slots, in a round that is followed level by level."""

from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from support.simulate import clock_by_clock

from tachometry.hdl.axes.axis_counters import AxisCounters
from tachometry.hdl.axes.axis_tick_counts import AxisTickCounts, counts_layout
from tachometry.hdl.axes.rounds import Rounds
from tachometry.hdl.axes.turns import Turns
from tachometry.spec.formats.tracking import Tracking

AXES, SLOTS, ROUNDS, TICKS = 3, 4, 5, 12
PHASE = {(0, 0): 0, (1, 0): 1, (1, 1): 2, (0, 1): 3}
OUTPUTS = ["axis", "step", "decode_error", "complete", "count"]


def played(level: NDArray[np.int64]) -> list[dict[str, int]]:
    """Return inputs by clock, of levels of both lines by axis and round."""
    rows = []
    for clock in range(level.shape[2] * SLOTS):
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
    return rows


def step_of(level: NDArray[np.int64], slot: int, round_: int) -> int | None:
    """Return what an axis counts in a round; None if both of its lines change."""
    if round_ < 3:
        return 0
    past, new = (PHASE[tuple(level[:, slot, at].tolist())] for at in (round_ - 1, round_))
    return {0: 0, 1: 1, 2: None, 3: -1}[(new - past) % 4]


def test_every_axis_counts_its_own_lines() -> None:
    level = np.random.default_rng(3).integers(0, 2, (2, AXES, ROUNDS * TICKS))
    seen = clock_by_clock(AxisCounters(slots=SLOTS, rounds=ROUNDS, decoding=4), played(level), OUTPUTS)
    counts = [0] * AXES
    for clock, row in enumerate(seen[3:]):
        round_, slot = divmod(clock, SLOTS)
        assert row["axis"] == slot
        assert row["complete"] == (round_ % ROUNDS == ROUNDS - 1)
        if slot == AXES:
            assert row["step"] == row["decode_error"] == row["count"] == 0
            continue
        found = step_of(level, slot, round_)
        step = found or 0
        counts[slot] = step if round_ % ROUNDS == 0 else counts[slot] + step
        assert (row["step"], row["decode_error"], row["count"]) == (step, found is None, counts[slot]), (round_, slot)


def test_every_axis_adds_up_what_tracking_takes_of_a_tick() -> None:
    """Held against sums over a list of its counts; a tick takes the first three, and all of them move the shaft."""
    level = np.random.default_rng(4).integers(0, 2, (2, AXES, ROUNDS * 4 * TICKS))
    form = Tracking(
        clock_hz=1_000_000,
        tick_cycles=ROUNDS,
        longest_tick=ROUNDS,
        external=False,
        max_count=3,
        counts_per_rev=400,
        max_memory=None,
        max_time=8 * ROUNDS,
        velocity_out=8,
        slope=Fraction(1, 2),
        velocity_std=Fraction(ROUNDS),
        std_bits=8,
    )
    assert form.most_number == 3
    counters = AxisTickCounts(slots=SLOTS, form=form, decoding=4)
    seen = clock_by_clock(
        counters, played(level), ["complete", *(f"count.{name}" for name in counts_layout(form).members)]
    )
    position = [0] * AXES
    n_compared = 0
    for clock, row in enumerate(seen[3:]):
        round_, slot = divmod(clock, SLOTS)
        if slot == AXES or not row["complete"]:
            continue
        begin, start = round_ + 1 - ROUNDS, position[slot]
        number = times = places = 0
        for at in range(begin, round_ + 1):
            if not (step := step_of(level, slot, at) or 0):
                continue
            lower = min(position[slot], position[slot] + step)
            if number < 3:
                number, times, places = number + 1, times + round_ - at, places + 2 * (lower - start) + 1
                kind, down = lower % 4, int(step < 0)
            last = round_ - at
            position[slot] += step
        expected = {"number": number, "times": times, "places": places, "moved": position[slot] - start}
        expected |= {"end": position[slot] % 4}
        if number:
            expected |= {"last": last, "kind": kind, "down": down}
        assert {name: row[f"count.{name}"] for name in expected} == expected, (round_, slot)
        n_compared += number > 1
    assert n_compared > 50


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


TURN_OUTPUTS = ["slot", "first", "last", "ready"]


@pytest.mark.parametrize(("slots", "rounds"), [(3, 1), (3, 2), (5, 4), (8, 7)])
def test_slots_and_rounds(slots: int, rounds: int) -> None:
    seen = clock_by_clock(Rounds(slots, rounds, 3), [{}] * (slots * (2 * rounds + 5)), TURN_OUTPUTS)
    for clock, row in enumerate(seen):
        round_ = clock // slots
        assert row == {
            "slot": clock % slots,
            "first": round_ % rounds == 0,
            "last": round_ % rounds == rounds - 1,
            "ready": round_ >= 3,
        }, clock
