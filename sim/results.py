"""What a core shows at its ports, as arrays: the common language of engines and golden models."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Ticks:
    """One row per strobe of `tick`.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clock in which `tick` is high.
    pulse_count, position : int64 arrays, shape (n,), counts
    overflow : bool array, shape (n,)
    swallowed_edges : int64 array, shape (n,)
        All zero without a filter.
    """

    clock: NDArray[np.int64]
    pulse_count: NDArray[np.int64]
    position: NDArray[np.int64]
    overflow: NDArray[np.bool_]
    swallowed_edges: NDArray[np.int64]


@dataclass(frozen=True)
class Updates:
    """One row per strobe of `velocity_valid`.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clock in which `velocity_valid` is high.
    velocity : int64 array, shape (n,)
        Raw value, 2^−frac_bits counts per tick.
    interval : int64 array, shape (n,)
        m_s.
    forced, stalled : bool arrays, shape (n,)
    """

    clock: NDArray[np.int64]
    velocity: NDArray[np.int64]
    interval: NDArray[np.int64]
    forced: NDArray[np.bool_]
    stalled: NDArray[np.bool_]


@dataclass(frozen=True)
class Run:
    """All that happened at the ports in clocks 0 … n_clocks − 1.

    Parameters
    ----------
    n_clocks : int
    ticks : Ticks
    updates : Updates
    errors : int64 array
        Clocks in which `decode_error` was high.
    """

    n_clocks: int
    ticks: Ticks
    updates: Updates
    errors: NDArray[np.int64]


@dataclass(frozen=True)
class Mismatch:
    """The first row in which two runs differ in one signal."""

    signal: str
    row: int
    expected: int | None
    actual: int | None

    def __str__(self) -> str:
        return f"{self.signal}[{self.row}]: expected {self.expected}, got {self.actual}"


def compare(expected: Run, actual: Run) -> tuple[int, list[Mismatch]]:
    """Hold two runs against each other, every row and every bit.

    Returns
    -------
    count : int
        Rows that differ, summed over all signals; a row that only one run has is one.
    first : list of Mismatch
        The first of them in each signal that differs.
    """
    count, first = 0, []
    pairs = [("errors", expected.errors, actual.errors)]
    for group in ("ticks", "updates"):
        left, right = getattr(expected, group), getattr(actual, group)
        pairs += [(f"{group}.{f.name}", getattr(left, f.name), getattr(right, f.name)) for f in fields(left)]
    for signal, left, right in pairs:
        common = min(len(left), len(right))
        differ = np.flatnonzero(left[:common] != right[:common])
        surplus = max(len(left), len(right)) - common
        if len(differ) or surplus:
            row = int(differ[0]) if len(differ) else common
            values = [int(side[row]) if row < len(side) else None for side in (left, right)]
            first.append(Mismatch(signal, row, *values))
            count += len(differ) + surplus
    return count, first
