"""Encoder signals as they travel through the project: change lists in seconds, then on the core's clock.

A `Recording` is what a virtual encoder or a logic analyser gives: the instants at which the lines change. `place`
puts it on a clock, as the first synchroniser flip-flop would see it; the `PinTrace` that results is what every engine
and every golden model takes. Both grow with the number of edges, never with the number of clocks.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Recording:
    """Levels of the encoder lines over continuous time.

    Parameters
    ----------
    time : float64 array, shape (n,), seconds, not decreasing, first entry 0
        Instant from which the levels of the same row hold.
    a, b : uint8 arrays, shape (n,), 0 or 1
        Levels of the lines from `time` on. Row 0 is the level at rest before the first edge.
    duration : float, seconds
        Length of the recording; not before the last change.
    """

    time: NDArray[np.float64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    duration: float

    def __post_init__(self) -> None:
        if not len(self.time) == len(self.a) == len(self.b) > 0:
            raise ValueError("a recording must have as many times as levels, and at least one row")
        if self.time[0] != 0 or np.any(np.diff(self.time) < 0):
            raise ValueError("times of a recording must begin at 0 and must not decrease")
        if self.duration < self.time[-1]:
            raise ValueError(f"duration must be at least {self.time[-1]} s, not {self.duration} s")

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
        clock, a, b = clock[last], self.a[last], self.b[last]
        changed = np.append(True, (a[1:] != a[:-1]) | (b[1:] != b[:-1]))
        return PinTrace(clock[changed], a[changed], b[changed], max(n_clocks, 1))


@dataclass(frozen=True)
class PinTrace:
    """Levels that the first synchroniser flip-flop samples, on the core's clock.

    Parameters
    ----------
    clock : int64 array, shape (n,), strictly increasing, first entry 0
        Clock edge from which the levels of the same row are sampled (clock edge 0 is the first after reset).
    a, b : uint8 arrays, shape (n,), 0 or 1
    n_clocks : int
        Number of clocks to run.
    """

    clock: NDArray[np.int64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    n_clocks: int

    def __post_init__(self) -> None:
        if not len(self.clock) == len(self.a) == len(self.b) > 0:
            raise ValueError("a pin trace must have as many clocks as levels, and at least one row")
        if self.clock[0] != 0 or np.any(np.diff(self.clock) <= 0):
            raise ValueError("clocks of a pin trace must begin at 0 and must increase")
