"""The datapath of Rairán's method, with injected steps."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support.nightly import only, only_rows
from support.rairan import DELAY, golden_updates, make_spec, random_steps, steps_of
from support.simulate import clock_by_clock

from tachometry.hdl.methods import rairan
from tachometry.sim.golden.methods.rairan import Model
from tachometry.spec import Speed
from tachometry.spec.core.ports import BOUNDS

NAMES = ["velocity", "interval", "forced", "n_ep1", "n_dt1"]


def check(step: np.ndarray, dt: int = 6, max_ticks: int = 9, **options: object) -> None:
    """Every update, in its clock, with every output; and every end of dt."""
    spec = make_spec(dt, max_ticks, **options)
    names = NAMES + [*BOUNDS, "bounds_valid"] * spec.bounds + ["dt_shift"] * (spec.adaptive is not None)
    rows = (
        [{"step_now": 0}] * spec.latency.registers_steps
        + [{"step_now": int(s)} for s in step]
        + [{"step_now": 0}] * DELAY
    )
    lengths = ["tick_shift"] * (spec.adaptive is not None)
    shown = ["velocity_valid", "last", "beyond", *lengths, *names]
    seen = clock_by_clock(rairan.RairanMethod(spec), rows, shown)[spec.latency.registers_steps :]
    got = [(clock, *(row[name] for name in names)) for clock, row in enumerate(seen) if row["velocity_valid"]]
    updates = golden_updates(spec, step)
    columns = [updates[name].astype(int).tolist() for name in names]
    assert got == list(zip((updates.clock + DELAY).tolist(), *columns, strict=True))
    ends, beyond, nominal = Model(spec).windows(steps_of(step), len(step))
    assert [clock for clock, row in enumerate(seen[: len(step)]) if row["last"]] == ends.tolist()
    assert [row["beyond"] for row in seen[: len(step)] if row["last"]] == beyond.astype(int).tolist()
    for name in lengths:
        assert [1 << seen[end + 2][name] for end in ends] == nominal.tolist()


def steps(dt: int = 6, n: int = 2500) -> np.ndarray:
    """Return backwards at first, at gaps that end with dt, and some just longer than dt after short ones; then
    anything.
    """
    gaps = np.repeat([dt, max(dt // 3, 1), dt + 2, max(dt // 2, 1), 5 * dt, 4 * dt + 1, max(dt // 3, 1), dt], 7)
    regular = np.zeros(gaps.sum() + 1, dtype=np.int64)
    regular[np.cumsum(gaps)] = -1
    regular[dt // 3] = -1  # the first count, before the first dt has ended
    return np.append(regular, random_steps(np.random.default_rng(1), n, dt))


# The least dt, and one in which counts are anywhere.
@pytest.mark.parametrize("dt", only([1, 6], [1, 2, 3, 6, 40]))
@pytest.mark.parametrize("options", [{}, {"paper_exact": True}, {"bound_decay": False}, {"bounds": True}])
def test_every_update(dt: int, options: dict[str, Any]) -> None:
    check(steps(dt), dt, **options)


ESTIMATES = [("n1", 4), ("n2", 4), ("n3", 4), ("n3", 5), ("n1", 9), ("n2", 9), ("n3", 9), ("n2", 24)]


# Each estimate once, with ties, without, and with the most bits.
@pytest.mark.parametrize(("estimate", "frac_bits"), only_rows([("n1", 9), ("n3", 4), ("n2", 24)], ESTIMATES))
def test_every_estimate(estimate: str, frac_bits: int) -> None:
    """With 4 fraction bits 1/32 is a tie, both ways."""
    by_turns = np.zeros(6000, dtype=np.int64)
    at = np.cumsum(np.tile([3, 20, 95, 96, 97, 100, 2, 2], 20))
    by_turns[at[at < 6000]] = np.repeat([1, -1], 80)[: np.count_nonzero(at < 6000)]
    check(by_turns, 3, 40, estimate=estimate, frac_bits=frac_bits)
    check(steps(40), 40, 40, estimate=estimate, frac_bits=frac_bits)


def steady_steps(dt: int, n: int = 10_000) -> np.ndarray:
    """Return constant speeds, for as long as it takes k to follow, with rests and reversals, and
    what is not regular.
    """
    rng = np.random.default_rng(7)
    gaps = [dt / 5, 3 * dt, dt / 2, 0.9 * dt, 20 * dt, 2 * dt, 8 * dt, 1, dt, 0.38 * dt, 0.5 * dt, 2 * dt, 0.78 * dt]
    signs, at = [], []
    now = 0.0
    for k, gap in enumerate(gaps):
        clocks = now + np.maximum(gap, 1) * np.arange(1, max(8, int(120 * dt / max(gap, dt / 3))))
        at.append(clocks.astype(np.int64))
        signs.append(np.full(len(clocks), -1 if k % 3 == 1 else 1))
        now = clocks[-1] + (50 * dt if k % 4 == 3 else 0)
    step = np.zeros(int(now) + 1, dtype=np.int64)
    step[np.concatenate(at)] = np.concatenate(signs)
    return np.append(step[:n], random_steps(rng, 2000, 3 * dt))


ADAPTIVE: list[tuple[int, int, int, dict[str, Any]]] = [
    (1, 20, 7, {"bounds": True}),
    (2, 70, 20, {"bounds": True}),
    (6, 40, 10, {"bounds": True}),
    (24, 9, 4, {"bounds": True}),
    (6, 40, 10, {"bound_decay": False}),
    (1, 20, 7, {"estimate": "n1", "frac_bits": 4}),
    (2, 70, 20, {"estimate": "n2", "frac_bits": 5, "bounds": True}),
    (24, 9, 4, {"max_speed": Speed.parse("20000rev/s"), "bounds": True}),
]


# One of each estimate, with and without bounds, and saturating; dt is 1, 2 and 24 clocks.
@pytest.mark.parametrize(("dt", "max_ticks", "target", "options"), only_rows(ADAPTIVE[-3:], ADAPTIVE))
def test_adaptive_dt(dt: int, max_ticks: int, target: int, options: dict[str, Any]) -> None:
    check(steady_steps(dt), dt, max_ticks, adaptive=Fraction(1, target), **options)


def test_adaptive_dt_with_bounds_and_with_n1() -> None:
    check(steady_steps(2), 2, 70, adaptive=Fraction(1, 20), bounds=True, max_speed=Speed.parse("5000rev/s"))
    check(steady_steps(6), 6, 40, adaptive=Fraction(1, 10), estimate="n1", frac_bits=4)
