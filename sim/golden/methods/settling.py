"""Golden model of a place that waits for a count."""

from collections.abc import Iterable

from tachometry.spec.formats.settling import Settling


class Settled:
    """Moves places that wait for a count to the middle of it as the velocity falls."""

    def __init__(self, settling: Settling) -> None:
        self._settling = settling
        self._waits, self._limit, self._mark = False, settling.half, 0

    def places(self, velocities: Iterable[int], counted: Iterable[bool], places: Iterable[int]) -> list[int]:
        """Return the places of the next updates, relative to their positions."""
        half, found = self._settling.half, list[int]()
        for velocity, has_count, place in zip(velocities, counted, places, strict=True):
            speed = velocity >> self._settling.speed_shift
            size = max(speed, ~speed)
            if has_count:
                self._waits, self._limit, self._mark = False, half, size >> 1
            else:
                slow = size <= self._mark
                self._waits |= max(place, ~place) >= half - (half >> 2) and (slow or self._limit < half)
                self._limit, self._mark = self._limit >> slow, self._mark >> slow
            found.append(max(~self._limit, min(place, self._limit)) if self._waits else place)
        return found
