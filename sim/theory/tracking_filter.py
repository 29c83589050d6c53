"""Between two counts the filter of the tracking method is a linear system with poles, bandwidth, noise and errors.

Here λ is constant, and a count comes every m·T_s. All depends on x = λ·m·T_s alone: θ = e^−x is the weight that the
past keeps with each count (the coefficient of Tsuji 2009, eq. (22), for the time since the last count). The gains are
those of a fading-memory polynomial of second degree (N. Morrison, Introduction to Sequential Smoothing and Prediction,
1969). Functions take x as a float; places are in counts, and times in m·T_s.
"""

import math

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.theory.checks import Floats

_PREDICT = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])

_SMALL = 0.01


def gains(x: float) -> Floats:
    """Return what place, velocity and acceleration take of an error, shape (3,)."""
    d = -math.expm1(-x)
    return np.array([1 - (1 - d) ** 3, 1.5 * d * (1 - (1 - d) ** 2), d**3])


def _step(x: float) -> NDArray[np.float64]:
    """Return what a prediction and a correction make of the state, shape (3, 3)."""
    return _PREDICT - np.outer(gains(x), _PREDICT[0])


def poles(x: float) -> NDArray[np.complex128]:
    """Return poles in z, shape (3,); in exact numbers all are θ = e^−x: three equal real poles, so no overshoot of its
    own.
    """
    return np.linalg.eigvals(_step(x)).astype(np.complex128)


def noise_gains(x: float) -> Floats:
    """Return standard deviations of place, velocity and acceleration, for places of counts with one
    of 1, shape (3,).
    """
    step, gain = _step(x), gains(x)
    # P = A·P·Aᵀ + k·kᵀ, solved for the nine elements of P.
    covariance = np.linalg.solve(np.eye(9) - np.kron(step, step), np.outer(gain, gain).ravel())
    return np.sqrt(covariance.reshape(3, 3).diagonal())


def worst_gain(x: float) -> float:
    """Return the velocity that errors of at most 1 in the places of counts can cause: the sum of |impulse response|."""
    if x < _SMALL:  # it is proportional to x, within 0.2 %
        return worst_gain(_SMALL) * x / _SMALL
    state, step = gains(x), _step(x)
    total, n = 0.0, math.ceil(40 / x)
    for _ in range(n):
        total += abs(state[1])
        state = step @ state
    return float(total)


def jerk_errors(x: float) -> Floats:
    """By how much place, velocity and acceleration stay behind a constant jerk of 1, shape (3,).

    A constant acceleration leaves no error. A jerk J in counts/s³ leaves these times J·(mT_s)³, J·(mT_s)² and J·mT_s.
    """
    keep = np.eye(3) - np.outer(gains(x), [1.0, 0.0, 0.0])
    return np.linalg.solve(np.eye(3) - keep @ _PREDICT, keep @ np.array([1 / 6, 1 / 2, 1.0]))


def bandwidth(x: float) -> float:
    """Tell where the velocity shown for a sine of the speed has 1/√2 of its amplitude: ω·m·T_s in rad, at most π."""
    gain, step = gains(x), _step(x)

    def amplitude(w: float) -> float:
        z = np.exp(1j * w)
        velocity = (np.linalg.inv(z * np.eye(3) - step) @ gain)[1] * z
        return float(abs(velocity) / w)

    low, high = 0.0, math.pi
    if amplitude(math.pi) > math.sqrt(0.5):
        return math.pi
    while high - low > 1e-9 * high:
        middle = (low + high) / 2
        low, high = (middle, high) if amplitude(middle) > math.sqrt(0.5) else (low, middle)
    return (low + high) / 2
