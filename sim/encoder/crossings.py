"""The instants at which a moving shaft passes the edges of an encoder's disc, to the last bit of a float."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tachometry.sim.encoder.motion import FloatArray

IntArray = NDArray[np.int64]

_CELLS_PER_PERIOD = 64
_CHUNK = 1 << 16  # cells or edges handled at once
_BISECT_AFTER = 40  # iterations of interpolation, of which ten are usual, before bisection makes an end of it
_NO_TIME = 1e-15  # seconds; instants below this one need no finer resolution than those at it
MAX_CELLS = 200_000_000


class Shaft(Protocol):
    """An angle (rad) that between its breakpoints (s) is a smooth function of time, wavy up to a frequency (Hz)."""

    @property
    def breakpoints(self) -> FloatArray: ...
    @property
    def max_frequency(self) -> FloatArray: ...
    def angle(self, t: ArrayLike) -> FloatArray: ...
    def speed(self, t: ArrayLike) -> FloatArray: ...
    def acceleration(self, t: ArrayLike) -> FloatArray: ...


@dataclass(frozen=True, eq=False)
class Disc:
    """The edges of a disc: edge k lies at the angle (k + offset[k mod len(offset)]) pitches and begins quarter k."""

    pitch_rad: float  # mean distance of edges: 2 pi / (4 pulses_per_rev)
    # displacement of edges, in pitches, each more than -1 and less than 1; edges must stay in order, and one entry 0
    # makes an ideal disc
    offset: FloatArray

    def threshold(self, k: IntArray) -> FloatArray:
        """Return angle of edge k, in pitches."""
        return k + self.offset[k % len(self.offset)]

    def quarter(self, angle_rad: FloatArray) -> IntArray:
        """Return index of the last edge at or below an angle; an angle exactly on an edge has passed it."""
        angle = angle_rad / self.pitch_rad
        k = np.floor(angle).astype(np.int64)
        return k - (angle < self.threshold(k)) + (angle >= self.threshold(k + 1))


def find_crossings(shaft: Shaft, disc: Disc) -> tuple[FloatArray, IntArray]:
    """Return the times of all passages of edges, in order, and the quarters that begin with them: the edge itself
    forwards, the one below it backwards.

    Time is cut into cells in which the angle is monotone, so that the quarters at a cell's ends tell which edges lie
    in it; each is then located between two neighbouring floats. A passage is the first instant at which
    `disc.quarter` of the shaft's angle has changed.

    It raises ValueError if the shaft is so long in motion at so high a frequency that there are more than `MAX_CELLS`
    cells.
    """
    times, quarters = zip((np.empty(0), np.empty(0, dtype=np.int64)), *passages(shaft, disc), strict=True)
    return np.concatenate(times), np.concatenate(quarters)


def passages(shaft: Shaft, disc: Disc, share: int = 1) -> Iterator[tuple[FloatArray, IntArray]]:
    """Yield what `find_crossings` returns, some at a time: fewer as each takes a larger share of memory."""
    length = np.diff(shaft.breakpoints, append=shaft.breakpoints[-1])  # the end is a cell of no length
    with np.errstate(over="ignore"):
        n_cells = np.maximum(np.ceil(length * _CELLS_PER_PERIOD * np.append(shaft.max_frequency, 0)), 1)
    if np.sum(n_cells) > MAX_CELLS:
        periods = MAX_CELLS // _CELLS_PER_PERIOD
        raise ValueError(f"motion and vibration must not swing more than {periods} times: shorten them or swing slower")
    first_cell = np.cumsum(np.append(0, n_cells[:-1].astype(np.int64)))
    for begin in range(0, int(first_cell[-1]), _CHUNK):
        cell = np.arange(begin, min(begin + _CHUNK, int(first_cell[-1])) + 1)
        j = np.searchsorted(first_cell, cell, side="right") - 1
        time = shaft.breakpoints[j] + length[j] * ((cell - first_cell[j]) / n_cells[j])
        time = _split(shaft.acceleration, time)  # now the speed is monotone in each cell and cannot hide two zeros
        time = _split(shaft.speed, time)
        yield from _crossings_of_cells(shaft, disc, time, -(-_CHUNK // share))


def _split(function: Callable[[FloatArray], FloatArray], time: FloatArray) -> FloatArray:
    """Return `time` and the zeros of a function that is continuous between them, but may jump at them."""
    low, high = time[:-1], np.nextafter(time[1:], -np.inf)
    cell = np.flatnonzero(np.sign(function(low)) * np.sign(function(high)) < 0)
    zeros = _sign_change(lambda t, _: function(t), low[cell], high[cell])
    return np.unique(np.concatenate([time, zeros]))


def _crossings_of_cells(shaft: Shaft, disc: Disc, time: FloatArray, most: int) -> Iterator[tuple[FloatArray, IntArray]]:
    """Yield passages between consecutive times, between which the angle is monotone, at most so many at a time."""
    quarter = disc.quarter(shaft.angle(time))
    steps = np.diff(quarter)
    last = np.cumsum(np.abs(steps))
    first = last - np.abs(steps)
    for begin in range(0, int(last[-1]), most):
        passage = np.arange(begin, min(begin + most, int(last[-1])))
        cell = np.searchsorted(last, passage, side="right")
        nth = passage - first[cell]
        forward = steps[cell] > 0
        edge = np.where(forward, quarter[cell] + 1 + nth, quarter[cell] - nth)
        yield _passages(shaft, disc, edge, time[cell], time[cell + 1]), np.where(forward, edge, edge - 1)


def _passages(shaft: Shaft, disc: Disc, edge: IntArray, low: FloatArray, high: FloatArray) -> FloatArray:
    threshold = disc.threshold(edge)
    return _sign_change(lambda t, i: shaft.angle(t) / disc.pitch_rad - threshold[i], low, high)


def _sign_change(
    function: Callable[[FloatArray, NDArray[np.intp]], FloatArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return first float after `low` from which a function is as it is at `high`: negative, or not.

    Chandrupatla's method (Adv. Eng. Softw. 28, 1997): inverse quadratic interpolation where it is safe, else bisection.
    `function(t, i)` is asked for the i-th problems only, i being those not yet solved.
    """
    found = high.copy()
    i = np.arange(len(low))
    x1, x2, f1, f2 = low, high, function(low, i), function(high, i)
    negative_at_high = f2 < 0
    fraction = f1 / (f1 - f2)
    iteration = 0
    while True:
        found[i] = np.where((f1 < 0) == negative_at_high[i], x1, x2)
        least = np.spacing(np.maximum(np.maximum(x1, x2), _NO_TIME)) / np.abs(x2 - x1)
        wide = least <= 0.5
        if not np.any(wide):
            return found
        i, x1, x2, f1, f2 = i[wide], x1[wide], x2[wide], f1[wide], f2[wide]
        x = x1 + np.clip(fraction[wide], least[wide], 1 - least[wide]) * (x2 - x1)
        f = function(x, i)
        same = (f < 0) == (f1 < 0)
        x1, x2, x3 = x, np.where(same, x2, x1), np.where(same, x1, x2)
        f1, f2, f3 = f, np.where(same, f2, f1), np.where(same, f1, f2)
        fraction = _interpolate(x1, x2, x3, f1, f2, f3) if iteration < _BISECT_AFTER else np.full(len(i), 0.5)
        iteration += 1


def _interpolate(
    x1: FloatArray, x2: FloatArray, x3: FloatArray, f1: FloatArray, f2: FloatArray, f3: FloatArray
) -> FloatArray:
    """Return where the root is expected, as a fraction of the distance from x1 to x2."""
    with np.errstate(divide="ignore", invalid="ignore"):  # of quotients that are not taken
        xi = (x1 - x2) / (x3 - x2)
        phi = (f1 - f2) / (f3 - f2)
        safe = (1 - np.sqrt(1 - xi) < phi) & (phi < np.sqrt(xi))
        quadratic = f1 / (f1 - f2) * (f3 / (f3 - f2)) + (x3 - x1) / (x2 - x1) * (f1 / (f3 - f1)) * (f2 / (f3 - f2))
    return np.where(safe, quadratic, 0.5)
