"""Captures of sensors other than quadrature become what their lines show, with a width for pulses that have none."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, OptionError
from tachometry.sim.signals.recording import Recording
from tachometry.spec import Encoder

Floats = NDArray[np.float64]
Levels = NDArray[np.uint8]


def fitted(recording: Recording, encoder: Encoder) -> Recording:
    """Return the recording of a sensor as its lines are: one of a line alone has none on B.

    Loggers of engines write a pulse as two rows with one time, 1 and 0. Where a rise is a count, such a pulse lasts for
    half the time to the next row. It raises OptionError if pulses have no width, and each of their edges is a count,
    and CaptureError if two pulses of a line come at one time.
    """
    if encoder.sensor in ("quadrature", "hall"):
        return recording
    recording = _with_first_pulse(recording)
    lines: tuple[str, ...] = ("a", "b") if encoder.sensor == "up-down" else ("a",)
    for line in lines:
        recording = _with_width(recording, line, edges=encoder.decoding == 2)
    if encoder.sensor != "pulses":
        return recording
    source = recording.source and replace(
        recording.source,
        lines={line: name for line, name in recording.source.lines.items() if line != "b"},
        still=tuple(line for line in recording.source.still if line != "b"),
    )
    return replace(recording, b=np.zeros_like(recording.b), source=source)


def _with_first_pulse(recording: Recording) -> Recording:
    """Return a recording that begins with a pulse of no width, earlier by the time to the next row: low before it."""
    later = recording.time[recording.time > 0]
    if not (later.size and recording.time[:2].tolist() == [0, 0] and recording.a[0] == 1):
        return recording
    lead = float(later[0])
    lines: dict[str, Any] = {name: np.append(line[:1], line) for name, line in recording.lines.items()}
    lines["a"][0] = 0
    time = np.append(0, recording.time + lead)
    return replace(recording, time=time, duration=recording.duration + lead, **lines)


def _with_width(recording: Recording, line: str, *, edges: bool) -> Recording:
    """Return the recording with pulses of a line that have no width made longer."""
    level = recording.lines[line]
    row = np.flatnonzero(np.diff(level)) + 1  # of its changes
    time, rises = recording.time[row], level[row] == 1
    none = np.append(False, ~rises[1:] & (np.diff(time) == 0))  # falls that come with their rise
    if edges and none.any():
        at = f"{np.count_nonzero(none)} in this capture, the first at {time[none][0]:.9g} s"
        raise OptionError("decoding", f"must be 1, which counts rises alone, for pulses of no width ({at}), not 2")
    if (together := np.flatnonzero(np.diff(time[rises]) == 0)).size:
        raise CaptureError(
            f"two pulses of a capture must not come at one time, as {len(together)} do here, the first at "
            f"{time[rises][together[0]]:.9g} s"
        )
    if not none.any():
        return recording
    distinct = np.unique(recording.time)
    place = np.searchsorted(distinct, time[none], side="right")
    kept = np.append(True, ~none)
    kept[1:][none] = place < len(distinct)  # the last one stays high
    time[none] = (time[none] + distinct[np.minimum(place, len(distinct) - 1)]) / 2
    at, of_line = (np.append(first, rest)[kept] for first, rest in ((0.0, time), (level[0], level[row])))
    return _merged(recording, line, at, of_line)


def _merged(recording: Recording, line: str, at: Floats, level: Levels) -> Recording:
    """Return the recording with other changes of one line."""
    every = np.unique(np.concatenate([recording.time, at]))
    rows = np.searchsorted(recording.time, every, side="right") - 1
    lines: dict[str, Any] = {name: levels[rows] for name, levels in recording.lines.items()}
    lines[line] = level[np.searchsorted(at, every, side="right") - 1]
    return replace(recording, time=every, **lines)
