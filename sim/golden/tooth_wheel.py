"""The golden wheel is full: it has the teeth that are missing, and none that is extra."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.core.tooth_wheel import ToothWheel

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Teeth:
    """Holds the teeth of a wheel, on the core's clock."""

    clock: Ints  # clocks of all teeth of the full wheel, there or not
    known: Ints  # of those from which on the place is known
    index: Ints  # of those that are the index
    errors: Ints  # of those that are where the gap must be, or are not where an extra one must be

    def synced(self, clock: Ints) -> NDArray[np.bool_]:
        """Return whether the place is known in these clocks, from those that are before them."""
        latest = [np.append(-1, at)[np.searchsorted(at, clock)] for at in (self.known, self.errors)]
        found: NDArray[np.bool_] = latest[0] > latest[1]
        return found


def filled(wheel: ToothWheel, teeth: Ints, n_clocks: int) -> Teeth:
    """Return all teeth up to a clock, from the clocks of those that are there.

    - `teeth`: Clocks, at least 2 apart.
    - `n_clocks`: Those of teeth that are put in are below.
    """
    if not wheel.gaps:
        return _without_extra(wheel, teeth)
    put_in: list[int] = []
    places: list[int] = []
    index: list[int] = []
    errors: list[int] = []
    several = len(wheel.gaps) > 1
    rows = [(wheel.teeth, gap) for gap in wheel.gaps]  # teeth and those missing, the latest last
    period = known = synced = row = 0
    before = -wheel.longest
    for tooth in [*teeth.tolist(), n_clocks]:
        since = tooth - before
        short, at_gap = since < wheel.longest, synced and row == rows[0][0]
        if at_gap:
            ideal = (before + number * period for number in range(1, rows[0][1] + 1))
            put_in += [clock for clock in ideal if clock < tooth]
        if tooth == n_clocks:
            break
        missing = rows[0][1] if synced else _missing(wheel, since, period)
        late = since > _halves(wheel.fewest_halves(missing if synced else wheel.sizes[0]), period)
        early = since <= _halves(wheel.most_halves, period)
        if late and (at_gap if synced else known and early and short):
            rows = [*rows[1:], (row, missing)] if several else rows
            synced = [sum(column) for column in zip(*rows, strict=True)] == [wheel.teeth, sum(wheel.gaps)]
            places += [tooth] * synced
            index += [tooth] * (synced and (not several or row == max(rows)[0]))
            row = 1
        else:
            errors += [tooth] * at_gap
            synced = synced and not at_gap
            row = min(row + 1, wheel.teeth)
            known, period = short, since if short else period
        before = tooth
    return Teeth(np.union1d(teeth, _array(put_in)), _array(places), _array(index), _array(errors))


def _missing(wheel: ToothWheel, since: int, period: int) -> int:
    """Return how many teeth a gap of this time misses."""
    larger = (size for size in wheel.sizes[1:] if since > _halves(2 * size + 1, period))
    return max(larger, default=wheel.sizes[0])


def _without_extra(wheel: ToothWheel, teeth: Ints) -> Teeth:
    extras: list[int] = []
    index: list[int] = []
    errors: list[int] = []
    period = known = synced = row = after = 0
    before = -wheel.longest
    for tooth in teeth.tolist():
        since = tooth - before
        long, short = since >= wheel.longest, 4 * since < 3 * period
        here = synced and row == wheel.teeth and not after
        if short and not (long or after) and (here if synced else known >= 3):
            extras.append(tooth)
            after = True
            continue
        if here:
            errors.append(tooth)
            synced = False
        if after:
            index.append(tooth)
            synced, row = True, 0
        row, after = row + 1, False
        known, period = (0, period) if long else (known + 1, since)
        before = tooth
    marks = _array(index)
    return Teeth(np.setdiff1d(teeth, extras), marks, marks, _array(errors))


def _halves(number: int, period: int) -> int:
    return number * period >> 1


def _array(clocks: list[int]) -> Ints:
    return np.array(clocks, dtype=np.int64)
