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
    step, illegal = decode(a, b, spec.encoder.decoding)
    at = clock[1:] + spec.pin_to_count
    cycles = spec.timing.tick_cycles
    n_ticks = max(0, (n_clocks - spec.tick_latency) // cycles)
    inside = at < n_ticks * cycles
    sums = np.zeros(n_ticks, dtype=np.int64)
    np.add.at(sums, at[inside] // cycles, step[inside])
    limit, half = spec.max_count, 1 << (spec.position_width - 1)
    ticks = Ticks(
        clock=(np.arange(n_ticks, dtype=np.int64) + 1) * cycles - 1 + spec.tick_latency,
        pulse_count=np.clip(sums, -limit, limit),
        position=(np.cumsum(sums) + half) % (2 * half) - half,
        overflow=np.abs(sums) > limit,
    )
    errors = at[illegal]
    return ticks, errors[errors < n_clocks]
