"""Random motions of which the exact angle is known at every tick, as whole numbers."""

import numpy as np
from numpy.typing import NDArray

SUBCOUNTS = 1 << 20  # in a count


def motion(n_ticks: int, max_count: int, seed: int) -> NDArray[np.int64]:
    """Return angles in 1/`SUBCOUNTS` at the start and at the end of every tick: all speeds, either way, and standstill.

    Steady for a while, at speeds from far below a count per tick to the greatest, then slowly changing, then at random.
    """
    rng = np.random.default_rng(seed)
    parts: list[NDArray[np.int64]] = []
    left = n_ticks
    while left:
        n = min(left, int(rng.integers(1, 3000)))
        top = (max_count - 1) * SUBCOUNTS * 10.0 ** rng.uniform(-5, 0)
        speed, end = rng.uniform(-top, top, 2)
        kind = rng.integers(4)
        if kind == 0:
            steps = np.full(n, speed)
        elif kind == 1:
            steps = np.linspace(speed, end, n)
        elif kind == 2:
            steps = rng.uniform(-top, top, n)
        else:  # about an edge, or still
            steps = np.where(rng.random(n) < 0.5, 0, rng.uniform(-1, 1, n) * SUBCOUNTS / 4)
        parts.append(steps.astype(np.int64))
        left -= n
    return np.append(0, np.cumsum(np.concatenate(parts))) + int(rng.integers(SUBCOUNTS))
