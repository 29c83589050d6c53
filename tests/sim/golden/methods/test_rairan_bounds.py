"""Bounds of Rairán's method: they enclose the true mean speed of every measured window, in exact integers."""

from fractions import Fraction

import numpy as np
import pytest
from support.rairan import golden_updates, make_spec, random_steps

FINE = 64  # parts of a clock in which the true times of the counts are known
FRAC_BITS = 10


def enclosed(dt: int, n: int, seed: int, **options: object) -> tuple[int, float, float]:
    """Return updates that were looked at, the mean width of their bounds, and that of [n2, n1], where both are finite.

    A count is seen in the first clock after it. What is measured goes from the true time of a count to that of the next
    (Ndt1), or to the last clock of dt, and between two counts in one direction the shaft turns evenly.
    """
    spec = make_spec(dt, 30, bounds=True, frac_bits=FRAC_BITS, **options)
    rng = np.random.default_rng([dt, seed])
    step = random_steps(rng, n, dt, turns=0.002)
    updates = golden_updates(spec, step)
    at = np.flatnonzero(step)
    sign = step[at]
    # At either end of the clock in particular.
    within = np.where(rng.random(len(at)) < 0.5, rng.integers(0, FINE, len(at)), rng.choice([0, FINE - 1], len(at)))
    true = np.append(at * FINE - within, (n + 100 * dt) * FINE)

    rows = np.flatnonzero(updates["bounds_valid"])
    in_dt = dt << updates["dt_shift"][rows] if spec.adaptive else np.full(len(rows), dt)
    clock, n_ep, n_dt = updates.clock[rows], updates["n_ep1"][rows], updates["n_dt1"][rows]
    forced, lower, upper = (x[rows] for x in (updates.forced, *(updates[f"velocity_{k}er"] for k in ("low", "upp"))))
    seen = np.searchsorted(at, clock, side="right") - 1  # the last count by then
    by_count = (step[clock] != 0) & (n_ep == 1) & ~forced
    last = seen - (step[clock] != 0)  # before this clock
    # Opening count: the one before, the one that began this dt, or the last at all.
    opening = np.where(by_count | forced, last, np.searchsorted(at, clock - in_dt))
    assert (by_count | forced | (at[np.minimum(opening, len(at) - 1)] == clock - in_dt)).all()
    following = np.minimum(last + 1, len(at))
    straight = (following < len(at)) & (np.append(sign, 0)[following] == sign[last])
    end = np.where(by_count, true[following], (clock - ~forced) * FINE)
    gap = true[following] - true[last]
    part = np.where(straight, np.clip(end - true[last], 0, gap), 0)
    # travelled/time in counts per dt is (whole·gap + part)·dt·FINE / (gap·time)
    # Each edge comes later by up to the edge error, in eighths: because of the disc, or of the lines.
    late = sign * rng.integers(0, int(8 * spec.bound.edge_error) + 1, len(at))
    late = np.append(late, late[-1:])
    whole, time = 8 * (last - opening) + late[last] - late[opening], end - true[opening]
    travelled = sign[last] * (whole * gap + part * (8 + late[following] - late[last])) * dt * FINE << FRAC_BITS
    none = spec.velocity.absent_bound
    assert ((8 * lower * gap * time <= travelled) | (lower == -none)).all()
    assert ((travelled <= 8 * upper * gap * time) | (upper == none)).all()

    finite = ~forced & (np.abs(lower) < none) & (np.abs(upper) < none) & (lower != 0) & (upper != 0)
    n2 = np.where(n_ep > 1, n_ep - 1, 1 / (n_dt + 1))[finite]
    width = (upper - lower)[finite] / 2**FRAC_BITS
    return len(rows), float(width.mean()), float((n_ep / n_dt)[finite].mean() - n2.mean())


@pytest.mark.parametrize("options", [{}, {"adaptive": Fraction(1, 7)}], ids=["", "adaptive"])
def test_discs_and_lines_within_the_edge_error(options: dict[str, object]) -> None:
    looked_at = 0
    for dt, error in ((2, 3), (8, 3), (8, 8)):
        found, _, _ = enclosed(dt, 500_000, seed=4, edge_error=Fraction(error, 8), **options)
        looked_at += found
    assert looked_at > 50_000
    # Bounds of an ideal disc do not enclose it.


def test_they_are_tight_where_dt_has_many_clocks() -> None:
    looked_at, width, least = enclosed(960, 20_000_000, seed=1)
    assert looked_at > 5000
    assert width < 1.03 * least
