"""A log of the time and of a count or an angle is read as the shaft that was measured."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, Channel, OptionError
from tachometry.sim.captures.header import PLAIN, TextOptions
from tachometry.sim.captures.rows import COUNTERS
from tachometry.sim.captures.series import ANGLES, read_series, unit_named, wraps_at
from tachometry.sim.signals.recording import MAX_EDGES, Recording, quadrature
from tachometry.sim.signals.source import Source
from tachometry.spec import Encoder

_MODULI = tuple(1 << bits for bits in COUNTERS)  # of the counters that wrap
NO_WRAP = 0


@dataclass(frozen=True)
class ShaftLog:
    """Where a shaft was, as a counter or a sensor of angles showed it."""

    time: NDArray[np.float64]  # shape (n,), seconds, strictly increasing, first entry 0
    place: NDArray[np.float64]  # shape (n,), counts or rad, first entry 0: since the first row; what wrapped goes on
    name: str  # of the column
    notes: tuple[str, ...]  # how the rows were understood
    angles: bool = False  # whether places are angles

    @property
    def source(self) -> Source:
        """Column of the log, and how its rows were understood; a change is one of a whole count."""
        total = 0 if self.angles else int(np.abs(np.diff(self.place)).sum())
        line = "angle" if self.angles else "count"
        still = () if np.any(np.diff(self.place)) else (line,)
        return Source({line: self.name}, float(self.time[-1]), total, still, notes=self.notes)

    def edges(self, encoder: Encoder, per_rev: int) -> NDArray[np.float64]:
        """Return the places, of the shaft if they are angles, in edges of a disc that has so many in a revolution."""
        rad = 2 * math.pi / float(encoder.turns)
        return self.place * (per_rev / (rad if self.angles else encoder.encoder_counts))

    def recording(self, encoder: Encoder) -> Recording:
        """Return the lines of an encoder in quadrature whose shaft turns evenly between two rows."""
        place = self.edges(encoder, 4 * encoder.pulses_per_rev)
        before = 0.5 * self.angles  # an edge leads to a count; it lies half a quarter before an angle
        quarter = np.rint(place)
        steps = np.diff(quarter)
        each = np.abs(steps).astype(np.int64)
        if (total := int(each.sum())) > MAX_EDGES:
            raise CaptureError(f"counts of {self.name} must be at most {MAX_EDGES} edges to and fro, not {total}")
        number = np.arange(1, total + 1) - np.repeat(np.cumsum(each) - each, each)
        sign = np.repeat(np.sign(steps), each)
        start, end, first, last, whole = (
            np.repeat(values, each) for values in (self.time[:-1], self.time[1:], place[:-1], place[1:], quarter[:-1])
        )
        part = (whole - first + sign * (number - before)) / (last - first)
        time = np.clip(start + (end - start) * part, start, end)
        level = quadrature(np.cumsum(np.append(0, sign.astype(np.int64))))
        duration = float(self.time[-1])
        source = replace(self.source, n_changes=total)
        return Recording(np.append(0.0, time), level & np.uint8(1), level >> np.uint8(1), duration, source=source)


def read_count_log(path: Path, count: Channel, text: TextOptions = PLAIN, wrap: int | None = None) -> ShaftLog:
    """Read a text with a column of times and one of counts, see `read_series`.

    The counter goes from one less than `wrap` to 0. `NO_WRAP`: it does not wrap. None: if it has 16 or 32 bits, as seen
    from a jump by more than half of them.
    """
    series, _ = read_series(path, count, "count", text, whole=True)
    counts = series.value.astype(np.int64)
    modulus = _seen(counts) if wrap is None else wrap
    if (spread := int(counts.max() - counts.min())) >= modulus > 0:
        raise OptionError("wrap", f"must be more than the counts of {path} differ, {spread}, not {modulus}")
    how = "as its greatest jump shows; --wrap 0 says that it does not" if wrap is None else "as --wrap says"
    notes = [f"the log begins at {counts[0]} counts, and counts out are since then"] if counts[0] else []
    place, wraps = _unwrapped(series.value, modulus)
    if modulus:
        notes.append(f"the counter wraps at {modulus}, {wraps} times here, {how}")
    return _log(series.time, place, series.name, (*series.notes, *notes))


def read_angle_log(path: Path, angle: str, text: TextOptions = PLAIN, wrap: int | None = None) -> ShaftLog:
    """Read a text with a column of times and one of angles, whose name may be followed by `:` and their unit.

    `wrap` is `NO_WRAP` or None: it wraps at a turn if all angles are within one, and it jumps by more than half of it.
    """
    if wrap:
        raise OptionError("wrap", f"must be 0 or left out with --angle: an angle wraps at a turn, not at {wrap}")
    name, colon, given = angle.rpartition(":")
    own = unit_named(given) if colon else ""
    series, unit = read_series(path, name if own in ANGLES else angle, "angle", text)
    if (unit := own or unit) not in ANGLES:
        raise OptionError(
            "angle", f"must have a unit, as {series.name}:deg: one of {', '.join(ANGLES)}, not {unit or angle!r}"
        )
    turn = round(2 * math.pi / ANGLES[unit], 9)  # 360 and 1 are exact
    place, wraps = _unwrapped(series.value, turn if wrap is None and wraps_at(series.value, turn) else 0.0)
    notes = [f"the angle wraps at {turn:.6g} {unit}, {wraps} times here; --wrap 0 says that it does not"]
    return _log(series.time, place * ANGLES[unit], series.name, (*series.notes, *notes[: bool(wraps)]), angles=True)


def _log(
    time: NDArray[np.float64], place: NDArray[np.float64], name: str, notes: tuple[str, ...], *, angles: bool = False
) -> ShaftLog:
    evenly = f"between two of the {len(time)} rows the shaft is taken to turn evenly"
    return ShaftLog(time, place, name, (evenly, *notes), angles)


def _unwrapped(value: NDArray[np.float64], modulus: float) -> tuple[NDArray[np.float64], int]:
    """Return how far the shaft has turned since the first row, and how often what shows it has wrapped."""
    steps = np.diff(value)
    taken = (steps + modulus / 2) % modulus - modulus / 2 if modulus else steps
    n_wraps = int(np.count_nonzero(np.abs(taken - steps) > modulus / 2)) if modulus else 0
    return np.cumsum(np.append(0.0, taken)), n_wraps


def _seen(counts: NDArray[np.int64]) -> int:
    """Return the modulus of a counter that jumps by more than half of it, signed or not; `NO_WRAP` if none does."""
    jump, least, most = np.abs(np.diff(counts)).max(), counts.min(), counts.max()
    for modulus in _MODULI:
        fits = (least >= 0 and most < modulus) or (-modulus // 2 <= least and most < modulus // 2)
        if fits and jump > modulus // 2:
            return modulus
    return NO_WRAP
