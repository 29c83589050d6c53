"""The golden wheel has the teeth that are missing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.core.tooth_wheel import ToothWheel

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Teeth:
    """Holds the teeth of a wheel, on the core's clock."""

    clock: Ints  # clocks of all teeth, there or not
    index: Ints  # of those that are the first ones after a gap
    errors: Ints  # of those that are where the gap must be

    def synced(self, clock: Ints) -> NDArray[np.bool_]:
        """Return whether the gap is known in these clocks, from those that are before them."""
        latest = [np.append(-1, at)[np.searchsorted(at, clock)] for at in (self.index, self.errors)]
        known: NDArray[np.bool_] = latest[0] > latest[1]
        return known


def filled(wheel: ToothWheel, teeth: Ints, n_clocks: int) -> Teeth:
    """Return all teeth up to a clock, from the clocks of those that are there.

    - `teeth`: Clocks, at least 2 apart.
    - `n_clocks`: Those of teeth that are put in are below.
    """
    put_in: list[int] = []
    index: list[int] = []
    errors: list[int] = []
    period = known = seen = 0  # teeth seen since the index, 0: it is not known
    before = -wheel.longest
    for tooth in [*teeth.tolist(), n_clocks]:
        since = tooth - before
        short, at_gap = since < wheel.longest, seen == wheel.teeth
        if at_gap:
            ideal = (before + number * period for number in range(1, wheel.missing + 1))
            put_in += [clock for clock in ideal if clock < tooth]
        if tooth == n_clocks:
            break
        late = since > (wheel.fewest_halves * period) >> 1
        early = since <= (wheel.most_halves * period) >> 1
        if late and (at_gap if seen else known and early and short):
            index.append(tooth)
            seen = 1
        else:
            if at_gap:
                errors.append(tooth)
            seen = 0 if at_gap or not seen else seen + 1
            known, period = short, since if short else period
        before = tooth
    arrays = [np.array(clocks, dtype=np.int64) for clocks in (put_in, index, errors)]
    return Teeth(np.union1d(teeth, arrays[0]), arrays[1], arrays[2])
