"""The golden adaptive dt says which counts open windows, and how long dt is in each."""

from bisect import bisect_left

import numpy as np
from numpy.typing import NDArray

from tachometry.spec import RairanTachometer
from tachometry.spec.methods.adaptive import AdaptiveDt

Ints = NDArray[np.int64]


def next_shift(rule: AdaptiveDt, shift: int, n: int, *, high: bool, falling: bool) -> tuple[int, bool]:
    """Return k of a window after one of dt·2^shift with Nep1 = n (high) or Ndt1 = n, and whether it is 0."""
    wanted = rule.slow + (shift > 0)
    seldom = n * wanted <= 1 << shift if high else n << shift >= wanted
    enough = high and n >= rule.fewest
    falls = seldom or (falling and not enough)
    if falls or (high and n >= 2 * rule.fewest):
        return max(shift - 1, 0), falls and shift > 1
    return shift if enough else min(shift + 1, rule.max_shift), False


def adaptive_windows(spec: RairanTachometer, start: Ints, next_turn: Ints) -> tuple[Ints, Ints, Ints]:
    """Return nodes at which windows open, those at which they end, and k of each; a step per window, as k is a
    recursion.

    - `start`, shape (n,): Clocks of the nodes: of the reset, of the counts, and of the end.
    - `next_turn`, shape (n,): The first node from each on that is a count against the direction, or the end.
    """
    clock, turn, rule = start.tolist(), next_turn.tolist(), spec.form.adaptive_dt
    end, node, shift, falling = len(clock) - 1, 0, 0, False
    found: list[tuple[int, int, int]] = []
    while node != end:
        due = clock[node] + (spec.timing.tick_cycles << shift)
        after = bisect_left(clock, due, node + 1, end)
        then = min(after, turn[node + 1]) if node else 1
        found.append((node, then, shift))
        c_ep = min(after - max(node, 1), spec.tick.max_count << shift)
        waited = (clock[then] - clock[node] - 1) // (due - clock[node])
        high = c_ep > 1 and waited <= 1
        n = c_ep if high else min(max(waited, 1), spec.form.max_dt(shift))
        anew = not node or then == turn[then] or waited >= spec.form.max_dt(shift)
        shift, falling = (0, False) if anew else next_shift(rule, shift, n, high=high, falling=falling)
        node = then
    nodes, thens, shifts = np.array(found, dtype=np.int64).T
    return nodes, thens, shifts
