"""The kinds of arrays that signals are made of, and numbers of so many bits."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Levels = NDArray[np.uint8]

_Whole = TypeVar("_Whole", int, Ints)


def wrapped(value: _Whole, bits: int) -> _Whole:
    """Return a number, or each of an array, in two's complement of so many bits."""
    half = 1 << bits - 1
    return (value + half & 2 * half - 1) - half
