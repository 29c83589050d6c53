"""Captures of other sensors become the quadrature that counts the same."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import OptionError
from tachometry.sim.signals.recording import Recording, quadrature
from tachometry.spec import TachometerSpec


def of_pulses(recording: Recording) -> Recording:
    """Return a single line, here A, as of a tooth wheel: always forward.

    B changes halfway between two edges of A, so what counts edges of A alone counts each at its time.
    """
    edges = recording.time[1:][np.diff(recording.a) != 0]
    halfway = (edges[1:] + edges[:-1]) / 2
    # Forward, A is the next line to change where the quarter is even, and low in quarter 0.
    first = 2 * int(recording.a[0])
    return _moved(recording, np.sort(np.concatenate([edges, halfway])), first, 1)


def of_steps(recording: Recording) -> Recording:
    """Step and direction: each rise of A is a count, forward where B is high after it."""
    rises = np.flatnonzero(np.diff(recording.a.astype(np.int8)) == 1) + 1
    return _moved(recording, recording.time[rises], 0, np.where(recording.b[rises] == 1, 1, -1))


def _moved(recording: Recording, times: NDArray[np.float64], first: int, steps: NDArray[np.int64] | int) -> Recording:
    """Return the recording with lines A and B that begin in a quarter period, and change by these steps at these
    times.
    """
    time = np.unique(np.concatenate([recording.time, times]))
    travelled = np.append(0, np.cumsum(np.broadcast_to(steps, times.shape)))
    level = quadrature(first + travelled[np.searchsorted(times, time, side="right")])
    row = np.searchsorted(recording.time, time, side="right") - 1
    z, tick_in = (None if line is None else line[row] for line in (recording.z, recording.tick_in))
    return Recording(time, level & np.uint8(1), level >> np.uint8(1), recording.duration, z, tick_in)


# What makes a quadrature of the lines of a sensor, and the decodings that count what the sensor counts.
SENSORS: dict[str, tuple[Callable[[Recording], Recording], tuple[int, ...]]] = {
    "pulses": (of_pulses, (1, 2)),
    "step-dir": (of_steps, (4,)),
}


def converted(recording: Recording, sensor: str, spec: TachometerSpec) -> Recording:
    """Return the recording of a sensor as quadrature; that of `quadrature` is as it is.

    Raises
    ------
    OptionError
        If the core's decoding would count something else.
    """
    if sensor == "quadrature":
        return recording
    convert, decodings = SENSORS[sensor]
    if spec.encoder.decoding not in decodings:
        allowed = " or ".join(map(str, decodings))
        raise OptionError("decoding", f"must be {allowed} for {sensor}, not {spec.encoder.decoding}")
    return convert(recording)
