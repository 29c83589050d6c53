"""Encoder signals as they travel through the project: change lists in seconds, then on the core's clock.

A `Recording` is what a virtual encoder or a logic analyser gives: the instants at which the lines change. `place`
puts it on a clock, as the first synchroniser flip-flop would see it; the `PinTrace` that results is what every engine
and every golden model takes. Both grow with the number of edges, never with the number of clocks. The index line Z may
be absent from both; where it is there, a row may change Z alone.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_ONE, _TWO = np.uint8(1), np.uint8(2)


class _Lines:
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    z: NDArray[np.uint8] | None

    @property
    def level(self) -> NDArray[np.uint8]:
        """a + 2 b + 4 z of each row; an absent Z is 0."""
        level = self.a | self.b << _ONE
        return level if self.z is None else level | self.z << _TWO


def _same_length(*columns: NDArray[np.generic] | None) -> bool:
    return len({len(column) for column in columns if column is not None}) == 1


@dataclass(frozen=True)
class Recording(_Lines):
    """Levels of the encoder lines over continuous time.

    Parameters
    ----------
    time : float64 array, shape (n,), seconds, not decreasing, first entry 0
        Instant from which the levels of the same row hold.
    a, b : uint8 arrays, shape (n,), 0 or 1
        Levels of the lines from `time` on. Row 0 is the level at rest before the first edge.
    duration : float, seconds
        Length of the recording; not before the last change.
    z : uint8 array, shape (n,), 0 or 1, or None
        Levels of the index line; None if it is absent.
    """

    time: NDArray[np.float64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    duration: float
    z: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        if not (len(self.time) and _same_length(self.time, self.a, self.b, self.z)):
            raise ValueError("a recording must have as many times as levels, and at least one row")
        if self.time[0] != 0 or np.any(np.diff(self.time) < 0):
            raise ValueError("times of a recording must begin at 0 and must not decrease")
        if self.duration < self.time[-1]:
            raise ValueError(f"duration must be at least {self.time[-1]} s, not {self.duration} s")

    @staticmethod
    def of_level(
        time: NDArray[np.float64], level: NDArray[np.uint8], duration: float, *, n_lines: int = 2
    ) -> "Recording":
        """The recording whose `level` is given, with two lines or, with Z, three."""
        a, b, *z = (level >> np.uint8(bit) & _ONE for bit in range(n_lines))
        return Recording(time, a, b, duration, *z)

    def place(self, clock_hz: int) -> "PinTrace":
        """Sample the lines at clock edge c = time c / clock_hz; a change between two edges is seen at the later one.

        A change within rounding of an edge, such as a decimal time on the clock's grid, is seen at that edge.
        """
        edges = self.time * clock_hz
        clock = np.ceil(edges - 2 * np.spacing(edges)).astype(np.int64)
        n_clocks = int(np.floor(self.duration * clock_hz))
        last = np.append(clock[1:] != clock[:-1], True) & (
            clock < max(n_clocks, 1)
        )  # of changes in one clock, the last
        row = np.flatnonzero(last)
        level = self.level[row]
        row = row[np.append(True, level[1:] != level[:-1])]
        z = None if self.z is None else self.z[row]
        return PinTrace(clock[row], self.a[row], self.b[row], max(n_clocks, 1), z)


@dataclass(frozen=True)
class PinTrace(_Lines):
    """Levels that the first synchroniser flip-flop samples, on the core's clock.

    Parameters
    ----------
    clock : int64 array, shape (n,), strictly increasing, first entry 0
        Clock edge from which the levels of the same row are sampled (clock edge 0 is the first after reset).
    a, b : uint8 arrays, shape (n,), 0 or 1
    n_clocks : int
        Number of clocks to run.
    z : uint8 array, shape (n,), 0 or 1, or None
        Index line; None if it is absent.
    """

    clock: NDArray[np.int64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    n_clocks: int
    z: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        if not (len(self.clock) and _same_length(self.clock, self.a, self.b, self.z)):
            raise ValueError("a pin trace must have as many clocks as levels, and at least one row")
        if self.clock[0] != 0 or np.any(np.diff(self.clock) <= 0):
            raise ValueError("clocks of a pin trace must begin at 0 and must increase")
