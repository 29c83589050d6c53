"""The method of Rairán a clock at a time, as docs/concepts/rairan.md says it, and its golden model on bare steps."""

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt
from typing import Any

import numpy as np

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.rairan import Model
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, RairanTachometer, Timing

DELAY = 4  # clocks from a step at the datapath to `velocity_valid`


def make_spec(dt: int, max_ticks: int = 10, **options: Any) -> RairanTachometer:
    """A core whose tick has so many clocks."""
    return RairanTachometer(
        encoder=Encoder(25), timing=Timing(1_000_000, dt, max_ticks), **({"frac_bits": 16} | options)
    )


def steps_of(step: np.ndarray) -> Steps:
    """Steps of every clock."""
    at, none = np.flatnonzero(step), np.empty(0, dtype=np.int64)
    return Steps(at, step[at].astype(np.int64), none, none, none)


def golden_updates(spec: RairanTachometer, step: np.ndarray) -> Table:
    """Updates that are caused in the clocks of these steps; `clock` is that of the cause."""
    delay = spec.registers_steps + DELAY
    updates = Model(spec).updates(None, steps_of(step), len(step) + delay)  # type: ignore[arg-type]
    updates.clock[:] -= delay
    return updates


@dataclass(frozen=True)
class Row:
    """An update: the clock that causes it, n1 = n_ep1/n_dt1, direction, and flags."""

    clock: int
    n_ep1: int
    n_dt1: int
    sign: int
    forced: bool
    rests: bool
    k: int = 0


def least_count(target: Fraction) -> int:
    """The least Nep1 for which eq. (13) is within the target."""
    n = 2
    while Fraction(1, 2 * n - 1) > target:
        n += 1
    return n


def next_k(k: int, falls: bool, n_ep: int, n_dt: int, target: Fraction, most: int) -> tuple[int, bool]:
    """k after a window of dt·2^k that measured Nep1/Ndt1, `most` being the greatest; and whether it falls to 0."""
    fewest = least_count(target)
    slow = min(fewest - 1, isqrt(2**most)) + (k > 0)
    # One count in so many dt, that of the measurement being 2^k of them.
    if Fraction(n_dt * 2**k, n_ep) >= slow:
        return max(k - 1, 0), k > 1
    if n_ep >= 2 * fewest:
        return max(k - 1, 0), False
    if n_ep >= fewest:
        return k, False
    return (k - 1, k > 1) if falls else (min(k + 1, most), False)


def clock_by_clock(
    step: list[int],
    dt: int,
    max_ticks: int,
    *,
    bound_decay: bool = True,
    adaptive: tuple[Fraction, int] | None = None,
) -> tuple[list[Row], list[int]]:
    """Updates, and clocks in which dt ends. `adaptive`: the target, and the greatest k."""
    k = k_of_n = 0
    falls = False
    clock = c_ep = c_dt = sign = 0
    n_ep, n_dt = 0, 1
    in_step, rest_is_new = False, True
    rows: list[Row] = []
    ends: list[int] = []

    for now, s in enumerate(step):
        clock += 1
        new: tuple[int, int] | None = None
        forced = rests = False
        then, measured, anew = k, None, False
        if s and sign and s != sign:  # against the last direction: a new window, and no estimate
            sign, clock, c_ep, c_dt, in_step, new = s, 0, 1, 0, True, (0, 1)
            then = 0
        elif s and (c_dt or not sign):  # the first count, and the first after dt, opens the next window
            if not sign or c_dt == max_ticks >> k:  # after reset or rest nothing is known of the time before it
                then, anew = 0, True
            else:
                if c_dt >= 2 or n_ep <= 1:
                    new = (1, c_dt)
                measured = new or (n_ep, n_dt)
            sign, clock, c_ep, c_dt, in_step = s, 0, 1, 0, True
        elif clock == dt << k:
            ends.append(now)
            if c_ep >= 2:
                new = (c_ep, 1)
            elif c_ep == 1 and n_ep >= 2:
                new = (1, 1)
            clock, c_ep, c_dt = 0, 0, min(c_dt + 1, max_ticks >> k)
            if s:  # the end of dt comes before the count, which opens the next window and has waited for one dt
                if new is None:
                    new = (1, 1)
                measured = new
                sign, c_ep, c_dt, in_step = s, 1, 0, True
            elif new is None and c_dt == max_ticks >> k and rest_is_new:
                new, forced, rests = (0, 1), True, True
            elif new is None and bound_decay and n_ep:
                waited = c_dt if in_step else c_dt - 1
                if waited and (n_ep > 1 or waited << k > n_dt << k_of_n):
                    new, forced = (1, waited), True
        elif s:
            sign, c_ep, in_step = s, c_ep + 1, False
        rest_is_new = c_dt < max_ticks >> k
        if new is not None:
            n_ep, n_dt = new
            k_of_n = k
            rows.append(Row(now, *new, sign, forced, rests, k))
        if adaptive is not None:
            if measured is not None:
                k, falls = next_k(k, falls, *measured, *adaptive)
            elif anew or then != k or (new == (0, 1) and not forced):
                k, falls = 0, False
    return rows, ends


def random_steps(rng: np.random.Generator, n: int, dt: int, *, turns: float = 0.02) -> np.ndarray:
    """Stretches of all speeds, regular and not, with reversals, dithering and rests; shape (n,), −1, 0 or +1."""
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
