"""Golden model of a place that waits for a count."""

from collections.abc import Iterable

from tachometry.spec.formats.angles import wrapped
from tachometry.spec.formats.settling import Settling


class Settled:
    """Moves places that wait for a count to the middle of it as the velocity falls."""

    def __init__(self, settling: Settling) -> None:
        self._settling = settling
        self._waits, self._limit, self._mark = False, settling.half, 0

    def places(self, velocities: Iterable[int], counted: Iterable[bool], places: Iterable[int]) -> list[int]:
        """Return the places of the next updates, relative to their positions."""
        half, found, bits = self._settling.half, list[int](), self._settling.place_bits
        for velocity, has_count, place in zip(velocities, counted, places, strict=True):
            speed = velocity >> self._settling.speed_shift
            size, near = max(speed, ~speed), wrapped(place, bits)
            ahead = max(near, ~near)
            if has_count:
                self._waits, self._limit, self._mark = False, half, size >> 1
            else:
                slow = size <= self._mark
                self._waits |= ahead >= half - (half >> 2) and (slow or self._limit < half)
                self._limit, self._mark = self._limit >> slow, self._mark >> slow
            limited = self._limit if near >= 0 else ~self._limit
            found.append(limited if self._waits and ahead > self._limit else place)
        return found
