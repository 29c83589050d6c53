"""Golden model of a place that waits for a count."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.methods.track_recursion import log2
from tachometry.sim.golden.sorted_lookup import Ints
from tachometry.spec.formats.tracking import PLACE_BITS, fixed_log

_HALF = 1 << PLACE_BITS - 1
_ONE = fixed_log(1)
_LEAST = fixed_log(np.log2(9 / 4))  # of a velocity in its LSB that is as good as none


class Settled:
    """Moves places that wait for a count to the middle of it as the velocity falls."""

    def __init__(self) -> None:
        self._waits, self._limit, self._mark = False, _HALF, 0

    def places(self, velocities: Ints, counted: NDArray[np.bool_], places: Ints) -> Ints:
        """Return the places of the next updates, relative to their positions, in 2^-PLACE_BITS."""
        found = list[int]()
        for velocity, has_count, place in np.column_stack((velocities, counted, places)).tolist():
            size = log2(velocity)
            if has_count:
                self._waits, self._limit, self._mark = False, _HALF, max(size - _ONE, _LEAST)
            elif size <= self._mark:
                self._limit, self._mark = self._limit >> 1, max(self._mark - _ONE, _LEAST)
            self._waits |= self._limit < _HALF and abs(place) >= _HALF - (_HALF >> 2)
            limited = min(abs(place), self._limit) if self._waits else abs(place)
            found.append(limited if place >= 0 else -limited)
        return np.array(found, dtype=np.int64)
