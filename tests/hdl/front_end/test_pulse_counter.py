import itertools

import numpy as np
import pytest
from amaranth import Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic.saturate import raised_for, saturate, saturate_raised
from tachometry.hdl.front_end.pulse_counter import PulseCounter
from tachometry.hdl.front_end.sampling_clock import SamplingClock


class Held(wiring.Component):
    """A number held within bounds, which may be raised for it."""

    def __init__(self, width: int, limit: int, *, raised: bool = False) -> None:
        self._limit = limit
        self._raised = raised
        super().__init__({"value": In(signed(width)), "held": Out(signed(limit.bit_length() + 1)), "changed": Out(1)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        if self._raised:
            most = 1 << (len(self.value) - 1)
            start = raised_for(most, self._limit)
            raised = Signal(signed((most + start).bit_length() + 1))
            m.d.comb += raised.eq(self.value + start)
            held, changed = saturate_raised(m, raised, self._limit)
        else:
            held, changed = saturate(m, self.value, self._limit)
        m.d.comb += [self.held.eq(held), self.changed.eq(changed)]
        return m


def check_counts(tick_cycles: int, max_count: int, seed: int, forward: float = 0.5, *, staged: bool = False) -> None:
    rng = np.random.default_rng(seed)
    n_ticks = 200
    steps = rng.choice([-1, 0, 1], size=(n_ticks, tick_cycles), p=[0.9 - forward, 0.1, forward])
    rows = [
        {"step": int(step), "last": int(clock == tick_cycles - 1)} for tick in steps for clock, step in enumerate(tick)
    ] + [{"step": 0, "last": 0}] * 5
    dut = PulseCounter(tick_cycles, max_count, staged=staged)
    seen = clock_by_clock(dut, rows, ["tick", "pulse_count", "overflow", "coming", "next_count"])
    strobes = [clock for clock, row in enumerate(seen) if row["tick"]]
    assert strobes == [(k + 1) * tick_cycles + 1 + 2 * staged for k in range(n_ticks)], seed
    # What comes is known a clock before it is shown.
    assert [clock + 1 for clock, row in enumerate(seen) if row["coming"]] == strobes, seed
    assert all(seen[c - 1]["next_count"] == seen[c]["pulse_count"] for c in strobes), seed
    sums = steps.sum(axis=1)
    assert [seen[c]["pulse_count"] for c in strobes] == np.clip(sums, -max_count, max_count).tolist(), seed
    assert [seen[c]["overflow"] for c in strobes] == (np.abs(sums) > max_count).astype(int).tolist(), seed
    # Held from strobe to strobe.
    for here, after in itertools.pairwise(strobes):
        assert all(seen[c]["pulse_count"] == seen[here]["pulse_count"] for c in range(here, after)), seed


@pytest.mark.parametrize(("tick_cycles", "max_count"), [(1, 1), (2, 2), (3, 3), (5, 2), (16, 16), (16, 4), (16, 1)])
def test_counts_every_step_once(tick_cycles: int, max_count: int) -> None:
    check_counts(tick_cycles, max_count, seed=tick_cycles)
    check_counts(tick_cycles, max_count, seed=tick_cycles, staged=True)


def check_bounds(width: int, limit: int, *, raised: bool = False) -> None:
    values = range(-(1 << (width - 1)), 1 << (width - 1))
    box = Held(width, limit, raised=raised)
    seen = clock_by_clock(box, [{"value": value} for value in values], ["held", "changed"])
    for value, row in zip(values, seen, strict=True):
        inside = max(-limit, min(limit, value))
        assert row == {"held": inside, "changed": int(inside != value)}, value


@pytest.mark.parametrize(("width", "limit"), [(2, 1), (2, 2), (3, 3), (5, 1), (5, 6), (5, 7), (5, 8), (5, 15), (5, 16)])
def test_every_value_within_its_bound(width: int, limit: int) -> None:
    check_bounds(width, limit)
    if raised_for(1 << (width - 1), limit):
        check_bounds(width, limit, raised=True)


def check_stretched(tick_cycles: int, max_count: int, seed: int) -> None:
    """Windows of any length, and all steps one way in some: a sum that has left its bounds stays there."""
    rng = np.random.default_rng(seed)
    rows, wanted = [], []
    for _ in range(200):
        length = int(rng.integers(1, 5 * tick_cycles))
        forward = rng.choice([0.1, 0.5, 0.8])
        steps = rng.choice([-1, 0, 1], size=length, p=[0.9 - forward, 0.1, forward])
        total, left = 0, 0
        for step in steps.tolist():
            total += step
            left = left or (total > max_count) - (total < -max_count)
        beyond = bool(rng.random() < 0.1)
        rows += [{"step": int(step), "last": 0, "beyond": 0} for step in steps]
        rows[-1] |= {"last": 1, "beyond": int(beyond)}
        wanted.append((left * max_count or total, int(left != 0 or beyond)))
    rows += [{"step": 0, "last": 0, "beyond": 0}] * 3
    dut = PulseCounter(tick_cycles, max_count, stretched=True)
    seen = clock_by_clock(dut, rows, ["tick", "pulse_count", "overflow"])
    assert [(row["pulse_count"], row["overflow"]) for row in seen if row["tick"]] == wanted
    assert any(overflow for _, overflow in wanted)


@pytest.mark.parametrize(("tick_cycles", "max_count"), [(1, 1), (2, 2), (3, 3), (4, 4), (7, 7), (8, 3), (16, 16)])
def test_a_window_may_be_longer_than_nominal(tick_cycles: int, max_count: int) -> None:
    check_stretched(tick_cycles, max_count, seed=tick_cycles)


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
