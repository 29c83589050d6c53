"""Places in ordered arrays are found here, without binary searches where a pass over the arrays is enough."""

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]

_PASSES = 4  # places that `not_before` goes on one by one
_JUMPS = 6  # `chain` follows 2^6 places at once


def places(ordered: Ints, values: Ints, side: str) -> Ints:
    """Return what `np.searchsorted` gives; for evenly spaced places, as ticks of the core's own clock are, by division.

    - `side`: `left` for how many of `ordered` are less than each value, `right` for how many are not greater.
    """
    n = len(ordered)
    step = int(ordered[1] - ordered[0]) if n > 1 else 0
    if step < 1 or np.any(np.diff(ordered) != step):
        return np.searchsorted(ordered, values, side=side)  # type: ignore[call-overload]
    within = values - int(ordered[0]) + (step if side == "right" else step - 1)
    return np.clip(within // step, 0, n)


def next_place(chosen: Ints, n: int) -> Ints:
    """Return the first of some ordered places after each of n places; n for none."""
    ends = np.append(chosen, n)
    return np.repeat(ends, np.diff(ends, prepend=0))


def not_before(clock: Ints, wanted: Ints) -> Ints:
    """Return the first place after each whose clock is not before the wanted one, which never falls; n for none."""
    n = len(clock)
    found = np.arange(1, n + 1)
    left = np.flatnonzero(clock[1:] < wanted[:-1])
    for _ in range(_PASSES):
        found[left] += 1
        left = left[found[left] < n]
        left = left[clock[found[left]] < wanted[left]]
    found[left] = np.searchsorted(clock, wanted[left])
    return found


def spans(begin: Ints, end: Ints) -> tuple[Ints, Ints]:
    """Return all numbers from each `begin` to before its `end`, and for each of them the row of its span."""
    length = np.maximum(end - begin, 0)
    row = np.repeat(np.arange(len(length)), length)
    return np.arange(len(row)) - (np.cumsum(length) - length - begin)[row], row


def chain(following: Ints) -> NDArray[np.bool_]:
    """Return which of n places are met from place 0 on; `following[k]` > k is the next after k, n for none.

    Where 64 jumps lead is found for all places at once. So only each 64th place that is met has to be followed.
    """
    n = len(following)
    jump, halves = np.append(following, n), []
    for _ in range(_JUMPS):
        halves.append(jump)
        jump = jump[jump]
    at, starts = 0, []
    while at < n:
        starts.append(at)
        at = int(jump[at])
    reached = np.array(starts, dtype=np.int64)
    for half in reversed(halves):
        reached = np.concatenate([reached, half[reached]])
    met = np.zeros(n + 1, dtype=np.bool_)
    met[reached] = True
    return met[:n]
