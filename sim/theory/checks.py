"""Ranges of the arguments, for both papers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def positive(what: str, value: ArrayLike) -> Floats:
    """The value as an array; ValueError if one is not greater than 0."""
    array = np.asarray(value, dtype=np.float64)
    if not np.all(array > 0):
        raise ValueError(f"{what} must be greater than 0")
    return array


def at_least(what: str, value: ArrayLike, least: float) -> Floats:
    """The value as an array; ValueError if one is less than `least`."""
    array = np.asarray(value, dtype=np.float64)
    if not np.all(array >= least):
        raise ValueError(f"{what} must be at least {least:g}")
    return array
