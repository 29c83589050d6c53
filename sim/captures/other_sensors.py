"""Captures of other sensors become the quadrature that counts the same."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, OptionError
from tachometry.sim.signals.recording import Recording, quadrature
from tachometry.spec import TachometerSpec


def of_pulses(recording: Recording, decoding: int) -> Recording:
    """Return a single line, here A, as of a tooth wheel: always forward.

    What counts edges of A alone counts each at its time: B changes halfway between two of them. What counts rises alone
    needs these only, and the falls may come at any time, also at that of a rise: three quarters of a period are spread
    up to the next rise.
    """
    recording = _with_first_pulse(recording)
    steps = np.diff(recording.a.astype(np.int8))
    parts = 2 if decoding == 2 else 4
    counted = recording.time[1:][steps != 0 if decoding == 2 else steps == 1]
    if decoding == 2 and (together := np.flatnonzero(np.diff(counted) == 0)).size:
        at = f"{len(together)} in this capture, the first at {counted[together[0]]:.9g} s"
        raise OptionError("decoding", f"must be 1, which counts rises alone, for pulses of no width ({at}), not 2")
    between = [counted[:-1] + np.diff(counted) * part / parts for part in range(1, parts)]
    # Forward, A is the next line to change where the quarter is even, and low in quarter 0.
    first = 2 * int(recording.a[0]) if decoding == 2 else 0
    return _moved(recording, counted, np.sort(np.concatenate([counted, *between])), first, 1)


def _with_first_pulse(recording: Recording) -> Recording:
    """Return a recording that begins with a pulse of no width so that the line is low before it: earlier, by the time
    to the next row.
    """
    later = recording.time[recording.time > 0]
    if not (later.size and recording.time[:2].tolist() == [0, 0] and recording.a[0] == 1):
        return recording
    lead = float(later[0])
    a, b = (np.append(line[:1], line) for line in (recording.a, recording.b))
    z, tick_in = (None if line is None else np.append(line[:1], line) for line in (recording.z, recording.tick_in))
    a[0] = 0
    return Recording(np.append(0, recording.time + lead), a, b, recording.duration + lead, z, tick_in, recording.source)


def of_steps(recording: Recording, decoding: int) -> Recording:
    """Return the quadrature of step and direction: each rise of A is a count, forward where B is high after it."""
    rises = np.flatnonzero(np.diff(recording.a.astype(np.int8)) == 1) + 1
    times = recording.time[rises]
    return _moved(recording, times, times, 0, np.where(recording.b[rises] == 1, 1, -1))


def _moved(
    recording: Recording,
    counted: NDArray[np.float64],
    times: NDArray[np.float64],
    first: int,
    steps: NDArray[np.int64] | int,
) -> Recording:
    """Return the recording with lines A and B that begin in a quarter period, and change by these steps at these
    times; those of what is counted are among them, and differ.
    """
    if (together := np.flatnonzero(np.diff(counted) == 0)).size:
        raise CaptureError(
            f"two pulses of a capture must not come at one time, as {len(together)} do here, the first at "
            f"{counted[together[0]]:.9g} s"
        )
    time = np.unique(np.concatenate([recording.time, times]))
    travelled = np.append(0, np.cumsum(np.broadcast_to(steps, times.shape)))
    level = quadrature(first + travelled[np.searchsorted(times, time, side="right")])
    row = np.searchsorted(recording.time, time, side="right") - 1
    z, tick_in = (None if line is None else line[row] for line in (recording.z, recording.tick_in))
    return Recording(time, level & np.uint8(1), level >> np.uint8(1), recording.duration, z, tick_in)


# What makes a quadrature of the lines of a sensor, and the decodings that count what the sensor counts.
SENSORS: dict[str, tuple[Callable[[Recording, int], Recording], tuple[int, ...]]] = {
    "pulses": (of_pulses, (1, 2)),
    "step-dir": (of_steps, (4,)),
}


def converted(recording: Recording, sensor: str, spec: TachometerSpec) -> Recording:
    """Return the recording of a sensor as quadrature; that of `quadrature` is as it is.

    Raises
    ------
    OptionError
        If the core's decoding would count something else.
    CaptureError
        If two pulses come at one time.
    """
    if sensor == "quadrature":
        return recording
    convert, decodings = SENSORS[sensor]
    if spec.encoder.decoding not in decodings:
        allowed = " or ".join(map(str, decodings))
        raise OptionError("decoding", f"must be {allowed} for {sensor}, not {spec.encoder.decoding}")
    # The second line is invented, or is a direction that may stay.
    source = recording.source and replace(
        recording.source,
        lines={line: name for line, name in recording.source.lines.items() if (sensor, line) != ("pulses", "b")},
        still=tuple(line for line in recording.source.still if line != "b"),
    )
    return replace(convert(recording, spec.encoder.decoding), source=source)
