"""At a constant speed the least squares of docs/concepts/track.md are linear: what they make of errors of the edges.

All depends on X, the time between two events over the memory. The functions know nothing of words and of programs.
"""

import functools
import math

import numpy as np

from tachometry.sim.theory import tsuji
from tachometry.sim.theory.checks import Floats

MOST_MEMORY_SECONDS = 4
MOST_EVENTS = 8192
LARGEST_SHARE = 1 / 4
ORDER_ONE = 1 / 64  # from this X on downward the acceleration is left out of what is shown, if it is not seen

_SMALL = 1 / 256  # below, all is proportional to a power of X, within 1 %
_STEPS = 16  # values of X in an octave for which errors are computed


@functools.cache
def velocity_errors(x: float) -> tuple[float, float]:
    """Return standard deviation and greatest error of the velocity, in counts per time between two events.

    `x` is X of a memory that has grown, at most 1/4. The first is for independent errors with a standard deviation of a
    count: √12·X^1.5, that of a least-squares line through the events of the memory, times 0.83 to 0.88 as older events
    fade (3.2 times √12·X^1.5 at X = 1/4, where the acceleration is seen). The second is for errors of at most a count:
    the sum of |impulse response|, 3·X (9.5·X).
    """
    if x < _SMALL:
        deviation, greatest = velocity_errors(_SMALL)
        return deviation * (x / _SMALL) ** 1.5, greatest * x / _SMALL
    e1 = x / ((1 + x) * (1 + 2 * x))
    gain = 9 * e1 * (1 - x) + 6 * e1 * x * x, 18 * x * e1 * (2 - x), 60 * x * x * e1
    shown = -0.5 / x if x <= ORDER_ONE else 0.0
    (place, velocity, acceleration), response = gain, []
    for _ in range(math.ceil(12 / x)):
        response.append(velocity + shown * acceleration)
        expected = place + velocity + acceleration / 2
        place, velocity = expected * (1 - gain[0]), velocity + acceleration - gain[1] * expected
        acceleration -= gain[2] * expected
    return math.sqrt(sum(value * value for value in response)), sum(map(abs, response))


def share(counts_per_tick: Floats, tick_seconds: float, max_memory: float = MOST_MEMORY_SECONDS) -> Floats:
    """Return X of a memory that has grown, at speeds in counts per tick; the counts of a tick are one event."""
    gap = tick_seconds * np.maximum(1 / counts_per_tick, 1)
    return np.clip(gap / max_memory, 1 / MOST_EVENTS, LARGEST_SHARE)


def errors(
    speed: Floats,
    edge_error: Floats | float,
    counts_per_rev: float,
    tick_seconds: float,
    max_memory: float = MOST_MEMORY_SECONDS,
) -> tuple[Floats, Floats]:
    """Return standard deviations and greatest errors of the velocity, in rad/s, at speeds in rad/s greater than 0.

    Offsets are learned, and the memory has grown. For the first, `edge_error` is the standard deviation of independent
    errors of edges, in counts; for the second the greatest error of any.
    """
    unit = tsuji.unit_velocity(counts_per_rev, tick_seconds)
    ratio = speed / unit
    x = share(ratio, tick_seconds, max_memory)
    deviation, greatest = (np.asarray(column) for column in zip(*map(_nearby, x.tolist()), strict=True))
    per_tick = np.minimum(ratio, 1) * edge_error * unit  # an error of a count from one event to the next, in rad/s
    return deviation * per_tick / np.sqrt(np.maximum(ratio, 1)), greatest * per_tick


def _nearby(x: float) -> tuple[float, float]:
    """Return `velocity_errors` from one that is near, as they are nearly proportional to powers of X."""
    near = 2 ** (round(math.log2(x) * _STEPS) / _STEPS)
    deviation, greatest = velocity_errors(near)
    return deviation * (x / near) ** 1.5, greatest * x / near
