"""A log of time and count, as a microcontroller's own counter gives it, is read as what turned the counter."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.cell_parsers import numbers
from tachometry.sim.captures.file import CaptureError, Channel, OptionError, check_edges, kind_of, reading
from tachometry.sim.captures.header import PLAIN, Header, TextOptions, check_seconds, read_header
from tachometry.sim.captures.rows import COUNTERS, Lines, Times, blocks, opened, refuse
from tachometry.sim.signals.arrays import Ints
from tachometry.sim.signals.recording import MAX_EDGES, Recording, quadrature
from tachometry.sim.signals.source import Source

_MODULI = tuple(1 << bits for bits in COUNTERS)  # of the counters that wrap
_MOST = 1 << 53  # counts that a number of a spreadsheet holds
NO_WRAP = 0


@dataclass(frozen=True)
class CountLog:
    """Holds what a counter showed."""

    time: NDArray[np.float64]  # shape (n,), seconds, strictly increasing, first entry 0
    count: Ints  # shape (n,), first entry 0: since the first row; what wrapped goes on
    name: str  # of the column
    notes: tuple[str, ...]  # how the rows were understood

    @property
    def source(self) -> Source:
        """Tells what the log says of itself; a change is one of the count."""
        total = int(np.abs(np.diff(self.count)).sum())
        return Source({"count": self.name}, float(self.time[-1]), total, () if total else ("count",), notes=self.notes)

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
        duration = float(self.time[-1])
        source = replace(self.source, n_changes=total)
        return Recording(np.append(0.0, time), level & np.uint8(1), level >> np.uint8(1), duration, source=source)


def read_count_log(path: Path, count: Channel, text: TextOptions = PLAIN, wrap: int | None = None) -> CountLog:
    """Read a text with a column of times and one of counts, whose head is that of `read_csv`.

    Rows of one time are one, the last of them.

    Parameters
    ----------
    count : str or int
        Name of the column, else its number among all columns, from 0.
    text : TextOptions
        What the text does not say; it has no threshold.
    wrap : int or None
        The counter goes from one less than this to 0. `NO_WRAP`: it does not wrap. None: if it has 16 or 32 bits, as
        seen from a jump by more than half of them.

    Raises
    ------
    CaptureError
        If the file cannot be read, or a row is not of this kind.
    """
    if kind_of(path) in (".sr", ".vcd", ".fst"):
        raise OptionError("count", f"must not be given for {path}: it has levels, not counts")
    with reading(path), opened(path) as file:
        source = Lines(path, file)
        header = read_header(path, source.head, text, None)
        if header.time is None:
            raise OptionError("time", f"must be given for {path}: counts must have times")
        column, times = _column(path, header, count), Times(path, header)
        parts = [
            np.stack([times.of(line, columns), _counts(path, line, header.names[column], columns[column])])
            for line, columns in blocks(path, source, header)
        ]
    if not source.ended:
        raise CaptureError(
            f"the last line of {path} must end, else its last number may be cut: put a line end there if it is whole"
        )
    rows = np.concatenate([np.zeros((2, 0)), *parts], axis=1).T
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
    check_seconds(path, header, text, np.diff(seconds), "rows", whole=times.whole)
    notes += times.notes
    notes.insert(0, f"between two of the {len(seconds)} rows the shaft is taken to turn evenly")
    if counts[0]:
        notes.append(f"the log begins at {counts[0]} counts, and counts out are since then")
    return CountLog(seconds, total - total[0], header.names[column], tuple(notes))


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


def _counts(path: Path, line: Sequence[int], name: str, texts: Sequence[str]) -> NDArray[np.float64]:
    """Return the counts of a block of rows."""
    count = numbers(texts)
    check_edges(path, line[-1])
    wrong = ~(np.abs(count) <= _MOST) | (count != np.rint(count))
    refuse(path, line, wrong, f"{name} must be a whole number up to 2^53", texts)
    return count


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
