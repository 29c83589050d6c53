"""Golden front end: from sampled levels to steps, pulse numbers and positions."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.results import Ticks
from tachometry.spec import TachometerSpec

# Where a pair of levels stands in the forward cycle 00, 10, 11, 01 of (A, B).
_PHASE = np.array([[0, 3], [1, 2]], dtype=np.int64)


def decode(a: NDArray[np.uint8], b: NDArray[np.uint8], decoding: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Step and illegal transition of each change of a list of levels.

    Parameters
    ----------
    a, b : uint8 arrays, shape (n,)
        Levels, each row different from the one before.
    decoding : int
        1, 2 or 4.

    Returns
    -------
    step : int64 array, shape (n − 1,)
        −1, 0 or +1.
    illegal : bool array, shape (n − 1,)
        Both lines changed.
    """
    turn = np.diff(_PHASE[a, b]) % 4
    step = np.array([0, 1, 0, -1], dtype=np.int64)[turn]
    of_a = a[1:] != a[:-1]
    counted = {4: np.ones_like(of_a), 2: of_a, 1: of_a & (b[1:] == 0)}[decoding]
    return np.where(counted, step, 0), turn == 2


def filter_line(
    clock: NDArray[np.int64], level: NDArray[np.uint8], clocks: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int64]]:
    """Glitch filter: a level counts only when it holds for so many clocks; the first one counts at once.

    Parameters
    ----------
    clock, level : arrays, shape (n,)
        Change list of one line.
    clocks : int

    Returns
    -------
    clock, level : arrays
        Change list of what passes, dated when it was first sampled.
    returned : int64 array
        Clocks at which a level that did not pass went back.
    """
    lasts = np.append(clock[1:] - clock[:-1] >= clocks, True)
    lasts[0] = True
    latest = np.maximum.accumulate(np.where(lasts, np.arange(len(clock)), 0))
    believed = level[latest]  # after each change, once it has held or gone
    glitch = np.flatnonzero(~lasts & (level != believed))
    changed = np.append(True, believed[1:] != believed[:-1])
    return clock[changed], level[changed], clock[glitch + 1]


def filter_lines(
    clock: NDArray[np.int64], a: NDArray[np.uint8], b: NDArray[np.uint8], clocks: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.uint8], NDArray[np.int64]]:
    """The filter on both lines: their common change list, and when glitches ended, in order."""
    lines = []
    for level in (a, b):
        changed = np.append(True, level[1:] != level[:-1])
        lines.append(filter_line(clock[changed], level[changed], clocks))
    common = np.union1d(lines[0][0], lines[1][0])
    a, b = (level[np.searchsorted(at, common, side="right") - 1] for at, level, _ in lines)
    return common, a, b, np.sort(np.concatenate([lines[0][2], lines[1][2]]))


def count(
    spec: TachometerSpec,
    clock: NDArray[np.int64],
    a: NDArray[np.uint8],
    b: NDArray[np.uint8],
    n_clocks: int,
) -> tuple[Ticks, NDArray[np.int64]]:
    """Pulse numbers and positions of all ticks whose strobe falls within `n_clocks`.

    Parameters
    ----------
    spec : TachometerSpec
    clock, a, b : arrays, shape (n,)
        Change list as in `PinTrace`.
    n_clocks : int

    Returns
    -------
    ticks : Ticks
    errors : int64 array
        Clocks in which `decode_error` is high.
    """
    returned = np.empty(0, dtype=np.int64)
    if spec.filter_clocks:
        clock, a, b, returned = filter_lines(clock, a, b, spec.filter_clocks)
    step, illegal = decode(a, b, spec.encoder.decoding)
    at = clock[1:] + spec.pin_to_count
    cycles = spec.timing.tick_cycles
    n_ticks = max(0, (n_clocks - spec.tick_latency) // cycles)
    inside = at < n_ticks * cycles
    sums = np.zeros(n_ticks, dtype=np.int64)
    np.add.at(sums, at[inside] // cycles, step[inside])
    limit, half = spec.max_count, 1 << (spec.position_width - 1)
    strobe = (np.arange(n_ticks, dtype=np.int64) + 1) * cycles - 1 + spec.tick_latency
    # Two clocks for the synchroniser, one for the counter.
    glitches = np.searchsorted(returned + 3, strobe, side="right")
    ticks = Ticks(
        clock=strobe,
        pulse_count=np.clip(sums, -limit, limit),
        position=(np.cumsum(sums) + half) % (2 * half) - half,
        overflow=np.abs(sums) > limit,
        swallowed_edges=2 * np.minimum(glitches, (1 << 15) - 1),
    )
    errors = at[illegal]
    return ticks, errors[errors < n_clocks]
