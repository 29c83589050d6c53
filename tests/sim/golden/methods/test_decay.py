"""The golden T method and its decay, clock by clock by the rules of docs/concepts/timed.md; and its parts."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from reference.front import Front, ticks_of
from reference.settings import Settings
from reference.timed import timed_updates
from reference.tsuji import Update

from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import Steps, count
from tachometry.sim.golden.methods.timed import Counts
from tachometry.sim.golden.sorted_lookup import chain
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, Speed, TachometerSpec, Timing, TTachometer

TICK, MAX_TICKS = 40, 8
NONE = np.empty(0, dtype=np.int64)


def make_spec(**options: Any) -> TTachometer:
    return TTachometer(encoder=Encoder(25), timing=Timing(100 * TICK, TICK, MAX_TICKS), **options)


def updates_of(spec: TachometerSpec, counts: dict[int, int], n_clocks: int) -> Table:
    """Return updates by the clocks of their causes; `counts` has the steps by their clocks."""
    at = np.array(sorted(counts), dtype=np.int64)
    steps = Steps(at, np.array([counts[clock] for clock in at.tolist()], dtype=np.int64), NONE, NONE, NONE)
    ticks, _ = count(spec, steps, np.arange(TICK - 1, n_clocks, TICK))
    updates = model(spec).updates(ticks, steps, n_clocks + spec.latency.tick)
    return updates.having(clock=updates.clock - spec.latency.datapath - spec.latency.tick)


def by_the_rules(spec: TTachometer, counts: dict[int, int], n_clocks: int) -> list[Update]:
    """Return those of the naive model."""
    words = {"clock": str(100 * TICK), "tick": f"{TICK}clk", "max-time": f"{TICK * MAX_TICKS}clk", "ppr": "25"}
    words |= {"timer": spec.timer, "frac-bits": str(spec.velocity.frac_bits), "edge-error": str(spec.bound.edge_error)}
    settings = Settings("t", words | {"bound-decay": "yes" if spec.bound_decay else "no"})
    front = Front(n_clocks, counts)
    ticks = ticks_of(settings, front, [*range(TICK - 1, n_clocks, TICK)], settings.max_count)
    return timed_updates(settings, front, ticks, spec.form.division_clocks)


def rounded(value: Fraction, frac_bits: int) -> Fraction:
    """Return to the nearest multiple of 2^−f, ties upward."""
    return Fraction(math.floor(value * 2**frac_bits + Fraction(1, 2)), 2**frac_bits)


def random_counts(seed: int, spec: TTachometer, n_clocks: int) -> dict[int, int]:
    """Return stretches of counts in one direction at least a division apart, with silences of all lengths."""
    rng = np.random.default_rng(seed)
    counts, clock, sign = {}, int(rng.integers(1, 3 * TICK)), 1
    least = TICK if spec.form.on_lattice else spec.form.division_clocks
    clock += (0, MAX_TICKS, 2 * MAX_TICKS + 3)[seed] * TICK
    while clock < n_clocks:
        gap = least * 10 ** rng.uniform(0, 0.7)
        for _ in range(int(rng.integers(1, 6))):
            counts[clock] = sign
            clock += int(gap * rng.uniform(1, 1.3)) + 1
        clock += int(rng.choice([0, 3, 6, MAX_TICKS - 1, MAX_TICKS, 2 * MAX_TICKS])) * TICK + int(rng.integers(TICK))
        sign *= int(rng.choice([1, 1, -1]))
    return {clock: sign for clock, sign in counts.items() if clock < n_clocks}


@pytest.mark.parametrize("edge_error", [Fraction(0), Fraction(1, 8), Fraction(1)])
@pytest.mark.parametrize("timer", ["clock", "tick"])
@pytest.mark.parametrize(("frac_bits", "bound_decay"), [(4, True), (12, True), (12, False)])
def test_every_update_is_by_the_rules(timer: str, frac_bits: int, bound_decay: bool, edge_error: Fraction) -> None:
    decays = 0
    for seed in range(3):
        spec = make_spec(timer=timer, frac_bits=frac_bits, bound_decay=bound_decay, bounds=True, edge_error=edge_error)
        n_clocks = 60 * MAX_TICKS * TICK
        counts = random_counts(seed, spec, n_clocks)
        updates = updates_of(spec, counts, n_clocks)
        rows = by_the_rules(spec, counts, n_clocks)
        ended = updates.clock < n_clocks - TICK  # counts beyond the end may take the divider
        rows = [row for row in rows if row.cause < n_clocks - TICK]
        one, none = 2**frac_bits, spec.velocity.absent_bound
        for name, wanted in (
            ("clock", [row.cause for row in rows]),
            ("interval", [row.interval for row in rows]),
            ("forced", [row.forced for row in rows]),
            ("velocity", [rounded(row.speed, frac_bits) * one for row in rows]),
            ("bounds_valid", [row.known for row in rows]),
            ("velocity_lower", [-none if row.lower is None else math.floor(row.lower * one) for row in rows]),
            ("velocity_upper", [none if row.upper is None else math.ceil(row.upper * one) for row in rows]),
        ):
            assert updates[name][ended].tolist() == wanted, (name, seed)
        assert not updates.get("out_of_range").any()
        decays += sum(row.forced and row.speed != 0 for row in rows)
    assert (decays > 50) == bound_decay


@pytest.mark.parametrize("sign", [1, -1])
def test_the_least_velocity_decays_to_0(sign: int) -> None:
    """A count in 600 clocks is 1/15 of a count a tick, an LSB; after 1920 clocks half an LSB is left, 60/1920."""
    timing = Timing(100 * TICK, TICK, 80)
    spec = TTachometer(encoder=Encoder(25), timing=timing, frac_bits=4, bounds=True)
    updates = updates_of(spec, {39: sign, 639: sign}, 70 * TICK)
    # Half an LSB is rounded upward: backwards to 0, forwards to an LSB, which is no less than the velocity.
    last = 639 + (1920 if sign < 0 else 1960)
    assert updates.clock.tolist() == [639, last]
    assert updates.velocity.tolist() == [sign, 0]
    ends = (math.floor(0), math.ceil(Fraction(40 * 16, last - 639)))
    assert (updates["velocity_lower"][1], updates["velocity_upper"][1]) == (ends if sign > 0 else (-ends[1], 0))


@pytest.mark.parametrize(("n_clocks", "seen"), [(71, 1), (72, 1), (73, 2), (101, 2), (102, 3)])
def test_counts_are_the_steps_that_come_before_the_end(n_clocks: int, seen: int) -> None:
    """The datapath sees a step two clocks after its clock; where a line changes without a step there is no count."""
    steps = Steps(np.array([2, 40, 70, 99]), np.array([1, 0, -1, 1]), NONE, NONE, NONE)
    ticks = Table(NONE, {"pulse_count": NONE})
    counts = Counts.of(make_spec(), ticks, steps, n_clocks)
    assert counts.period.tolist() == [4, 72, 101][:seen]
    assert counts.size.tolist() == [1, -1, 1][:seen]
    assert counts.n_periods == n_clocks


def test_just_the_maximum_speed_is_in_range() -> None:
    """At most one count a tick: two counts in 40 clocks are that, in 39 clocks they are more."""
    spec = make_spec(max_speed=Speed(Fraction(1), "rev/s"), frac_bits=8)
    assert spec.tick.max_count == 1
    for sign in (1, -1):
        updates = updates_of(spec, {5: sign, 45: sign, 84: sign, 125: sign}, 170)
        assert updates.velocity[:3].tolist() == [256 * sign, 256 * sign, int(rounded(Fraction(40, 41) * sign, 8) * 256)]
        assert updates["out_of_range"][:3].tolist() == [False, True, False]


@pytest.mark.parametrize("n", range(1, 7))
def test_a_chain_is_what_is_met_one_after_the_other(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(100):
        following = np.array([rng.integers(k + 1, n + 1) for k in range(n)])
        if rng.random() < 0.5:
            following = np.maximum.accumulate(following)
        met, at = [False] * n, 0
        while at < n:
            met[at], at = True, int(following[at])
        assert chain(following).tolist() == met
    assert chain(NONE).tolist() == []
