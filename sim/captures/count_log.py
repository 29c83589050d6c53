"""A log of time and count, as a microcontroller's own counter gives it, is read as what turned the counter."""

import csv
import gzip
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, Channel, OptionError, check_edges, reading
from tachometry.sim.captures.header import COMMENTS, LONGEST, Header, read_header
from tachometry.sim.signals.arrays import Ints
from tachometry.sim.signals.recording import MAX_EDGES, Recording, quadrature
from tachometry.sim.signals.source import Source

_MODULI = (1 << 16, 1 << 32)  # of the counters that wrap
_MOST = 1 << 53  # counts that a number of a spreadsheet holds
_LATEST = 1e30  # of any unit
NO_WRAP = 0


@dataclass(frozen=True)
class CountLog:
    """Holds what a counter showed.

    Parameters
    ----------
    time : float64 array, shape (n,), seconds, strictly increasing, first entry 0
    count : int64 array, shape (n,), first entry 0
        Since the first row; what wrapped goes on.
    name : str
        Of the column.
    notes : tuple of str
        How the rows were understood.
    """

    time: NDArray[np.float64]
    count: Ints
    name: str
    notes: tuple[str, ...]

    def recording(self, decoding: int) -> Recording:
        """Return the lines of an encoder whose shaft turns evenly between two rows; a decoding makes these counts."""
        steps = np.diff(self.count) * (4 // decoding)
        each = np.abs(steps)
        if (total := int(each.sum())) > MAX_EDGES:
            raise CaptureError(f"counts of {self.name} must be at most {MAX_EDGES} edges to and fro, not {total}")
        part = np.arange(1, total + 1) - np.repeat(np.cumsum(each) - each, each)
        start, end = np.repeat(self.time[:-1], each), np.repeat(self.time[1:], each)
        time = np.minimum(start + (end - start) * (part / np.repeat(each, each)), end)
        level = quadrature(np.cumsum(np.append(0, np.repeat(np.sign(steps), each))))
        still = () if total else ("count",)
        duration = float(self.time[-1])
        source = Source({"count": self.name}, duration, total, still, notes=self.notes)
        return Recording(np.append(0.0, time), level & np.uint8(1), level >> np.uint8(1), duration, source=source)


def read_count_log(path: Path, count: Channel, time: Channel | None = None, wrap: int | None = None) -> CountLog:
    """Read a text with a column of times and one of counts, whose head is that of `read_csv`.

    Rows of one time are one, the last of them.

    Parameters
    ----------
    path : Path
    count, time : str or int
        Name of the column, else its number among all columns, from 0; None: that named `time`.
    wrap : int or None
        The counter goes from one less than this to 0. `NO_WRAP`: it does not wrap. None: if it has 16 or 32 bits, as
        seen from a jump by more than half of them.

    Raises
    ------
    CaptureError
        If the file cannot be read, or a row is not of this kind.
    """
    if path.suffix.lower() in (".sr", ".vcd"):
        raise OptionError("count", f"must not be given for {path}: it has levels, not counts")
    with reading(path), _opened(path) as file:
        header = read_header(path, file, time, None)
        if header.time is None:
            raise OptionError("time", f"must be given for {path}: counts must have times")
        column = _column(path, header, count)
        try:
            rows = np.array(list(_rows(path, file, header, column)), dtype=np.float64)
        except csv.Error as error:
            raise CaptureError(f"{path} must be rows of numbers: {error}") from None
    if len(rows) < 2:
        raise CaptureError(f"{path} must have at least two rows after its header, not {len(rows)}")
    seconds, counts = header.seconds(rows[:, 0] - rows[0, 0]), rows[:, 1].astype(np.int64)
    steps, notes = _unwrapped(path, counts, wrap)
    last = np.append(np.diff(seconds) > 0, True)
    if len(again := np.flatnonzero(~last)):
        notes.append(f"{len(again)} rows have the time of the next one, which holds")
    seconds, total = seconds[last], np.cumsum(np.append(0, steps))[last]
    if len(seconds) < 2:
        raise CaptureError(f"times of {path} must not all be equal")
    notes.insert(0, f"between two of the {len(seconds)} rows the shaft is taken to turn evenly")
    if counts[0]:
        notes.append(f"the log begins at {counts[0]} counts, and counts out are since then")
    return CountLog(seconds, total - total[0], header.names[column], tuple(notes))


def _opened(path: Path) -> BinaryIO:
    return cast(BinaryIO, gzip.open(path)) if path.suffix.lower() == ".gz" else path.open("rb")


def _column(path: Path, header: Header, count: Channel) -> int:
    names, wanted = [name.casefold() for name in header.names], str(count).strip()
    if wanted in header.names:
        return header.names.index(wanted)
    if wanted.casefold() in names:
        return names.index(wanted.casefold())
    if wanted.isascii() and wanted.isdigit() and int(wanted) < len(names):
        return int(wanted)
    listed = ", ".join(f"{name} ({number})" for number, name in enumerate(header.names))
    raise OptionError("count", f"of {path} must be one of the columns {listed}, not {count!r}")


def _rows(path: Path, file: BinaryIO, header: Header, column: int) -> Iterator[tuple[float, float]]:
    """Give time and count of each row, checked."""
    assert header.time is not None
    before = -_LATEST
    text = (line.decode("utf-8", errors="replace") for line in iter(lambda: file.readline(LONGEST), b""))
    for number, row in enumerate(csv.reader(text, delimiter=header.separator), header.lines + 1):
        if not row or row[0].startswith(COMMENTS):
            continue
        try:
            time, count = (float(row[k].replace(",", ".")) for k in (header.time, column))
        except (ValueError, IndexError):
            shown = header.separator.join(row)[:60]
            raise CaptureError(f"{path} line {number}: time and count must be numbers, not {shown!r}") from None
        if not before <= time <= _LATEST:
            least = f"at least {before:.15g} {header.unit} as before" if before > -_LATEST else "a finite number"
            raise CaptureError(f"{path} line {number}: time must be {least}, not {time:.15g}")
        if not (abs(count) <= _MOST and count == int(count)):
            raise CaptureError(f"{path} line {number}: count must be a whole number up to 2^53, not {count:.15g}")
        before = time
        check_edges(path, number)
        yield time, count


def _unwrapped(path: Path, counts: Ints, wrap: int | None) -> tuple[Ints, list[str]]:
    """Return the steps from row to row, and what there is to say of a counter that wraps."""
    steps = np.diff(counts)
    modulus = _seen(counts, steps) if wrap is None else wrap
    if not modulus:
        return steps, []
    spread = int(counts.max() - counts.min())
    if spread >= modulus:
        raise OptionError("wrap", f"must be more than the counts of {path} differ, {spread}, not {modulus}")
    taken = (steps + modulus // 2) % modulus - modulus // 2
    n_wraps = np.count_nonzero(taken != steps)
    how = "as its greatest jump shows; --wrap 0 says that it does not" if wrap is None else "as --wrap says"
    return taken, [f"the counter wraps at {modulus}, {n_wraps} times here, {how}"]


def _seen(counts: Ints, steps: Ints) -> int:
    """Return the modulus of a counter that jumps by more than half of it, signed or not; `NO_WRAP` if none does."""
    jump, least, most = np.abs(steps).max(), counts.min(), counts.max()
    for modulus in _MODULI:
        fits = (least >= 0 and most < modulus) or (-modulus // 2 <= least and most < modulus // 2)
        if fits and jump > modulus // 2:
            return modulus
    return NO_WRAP
