"""Checks the ranges of arguments, for both papers."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

# A computed estimate is to be the end of its regime in spite of the rounding of a double.
_SLACK = 1e-9


def positive(what: str, value: ArrayLike) -> Floats:
    """Return the value as an array; ValueError if one is not greater than 0."""
    array = np.asarray(value, dtype=np.float64)
    if not np.all(array > 0):
        raise ValueError(f"{what} must be greater than 0")
    return array


def at_least(what: str, value: ArrayLike, least: float) -> Floats:
    """Return the value as an array; ValueError if one is less than `least`."""
    array = np.asarray(value, dtype=np.float64)
    if not np.all(array >= least):
        raise ValueError(f"{what} must be at least {least:g}")
    return array


def in_a_regime(what: str, value: ArrayLike, low_end: float, high_end: float) -> Floats:
    """Return the value as an array; ValueError if one is not greater than 0, or lies between the regimes.

    It is an estimate in units of ω_lim: at most `low_end` at low speeds, at least `high_end` at high ones.
    """
    array = positive(what, value)
    if np.any((array > low_end * (1 + _SLACK)) & (array < high_end * (1 - _SLACK))):
        raise ValueError(f"{what} must be at most {low_end:.4g} or at least {high_end:.4g}")
    return array
