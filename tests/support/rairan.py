"""The golden model of the method of Rairán on bare steps, and random steps."""

from typing import Any

import numpy as np

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.rairan import Model
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, RairanTachometer, Timing

DELAY = 4  # clocks from a step at the datapath to `velocity_valid`


def make_spec(dt: int, max_ticks: int = 10, **options: Any) -> RairanTachometer:
    """Return a core whose tick has so many clocks."""
    return RairanTachometer(
        encoder=Encoder(25), timing=Timing(1_000_000, dt, max_ticks), **({"frac_bits": 16} | options)
    )


def steps_of(step: np.ndarray) -> Steps:
    """Return steps of every clock."""
    at, none = np.flatnonzero(step), np.empty(0, dtype=np.int64)
    return Steps(at, step[at].astype(np.int64), none, none, none)


def golden_updates(spec: RairanTachometer, step: np.ndarray) -> Table:
    """Return updates that are caused in the clocks of these steps; `clock` is that of the cause."""
    delay = spec.latency.registers_steps + DELAY
    updates = Model(spec).updates(None, steps_of(step), len(step) + delay)  # type: ignore[arg-type]
    updates.clock[:] -= delay
    return updates


def random_steps(rng: np.random.Generator, n: int, dt: int, *, turns: float = 0.02) -> np.ndarray:
    """Return stretches of all speeds, regular and not, with reversals, dithering and rests; shape (n,), −1, 0 or +1."""
    step = np.zeros(n, dtype=np.int64)
    at, sign = 0, 1
    while at < n:
        gap = dt * 10 ** rng.uniform(-1.5, 1.3)
        if rng.random() < 0.3:
            gap = dt / int(rng.integers(1, 6)) if rng.random() < 0.5 else dt * int(rng.integers(1, 6))
        jitter = rng.choice([0, 0, 0.3])
        count = int(rng.integers(1, 40))
        gaps = np.maximum(1, np.rint(gap * (1 + jitter * rng.standard_normal(count)))).astype(np.int64)
        at += int(rng.integers(1, 3 * dt)) if rng.random() < 0.9 else int(rng.integers(1, 30 * dt))
        clocks = at + np.cumsum(gaps)
        signs = np.where(rng.random(count) < turns, -1, 1).cumprod() * sign
        if rng.random() < 0.1:
            signs = sign * np.where(np.arange(count) % 2, -1, 1)  # dithers on one edge
        sign = int(signs[-1])
        inside = clocks < n
        step[clocks[inside]] = signs[inside]
        at = int(clocks[-1])
    return step
