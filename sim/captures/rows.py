"""The rows of a text are read in blocks, whatever program wrote it, and their times do not decrease."""

import csv
import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from itertools import chain
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures import cell_parsers
from tachometry.sim.captures.file import CaptureError, opened_bytes
from tachometry.sim.captures.header import Header
from tachometry.sim.captures.text_layout import is_comment
from tachometry.sim.captures.time_unit import unit_named
from tachometry.spec.language.units import plural

LONGEST = 1 << 16  # characters of a line, and of all that is above the rows
BLOCK = 1 << 16  # rows parsed at once
# Beyond it a time or the number of a sample is a mistake.
_LATEST, _LAST_SAMPLE = 1e30, 1e15
COUNTERS = (16, 32)  # bits of counters whose times wrap
_DAY = 86_400 * 10**9  # nanoseconds


@contextmanager
def opened(path: Path) -> Iterator[TextIO]:
    """Open a text: UTF-16 if its first bytes say so, else UTF-8; anything else is the reader's to refuse."""
    with opened_bytes(path) as file:
        encoding = "utf-16" if file.peek(2)[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
        yield io.TextIOWrapper(file, encoding, errors="replace", newline="\n")


class Lines:
    """Gives the lines of a text, comments and blank lines left out, and counts them."""

    def __init__(self, path: Path, file: TextIO) -> None:
        self._path, self._file = path, file
        self.number = 0
        self.ended = True
        left, self.head = LONGEST, list[str]()
        while left > 0 and (line := self._line()):
            left -= len(line)
            self.head.append(line)
            if "\r" in line.rstrip("\r\n"):
                raise CaptureError(f"lines of {path} must end in LF or CR LF, not CR")

    def _line(self) -> str:
        line = self._file.readline(LONGEST)
        self.ended = line.endswith("\n") if line else self.ended
        if len(line) == LONGEST and not self.ended:
            raise CaptureError(f"lines of {self._path} must have less than {LONGEST} characters")
        return line

    def rows(self, start: int) -> Iterator[str]:
        """Give those from a line of the head on."""
        for number, line in enumerate(chain(self.head[start:], iter(self._line, "")), start + 1):
            if not is_comment(line):
                self.number = number
                yield line


def check_rows(path: Path, source: Lines, n: int) -> None:
    """Check that a text that has been read has two rows, and that the last one is whole."""
    if not source.ended:
        raise cut(path)
    if n < 2:
        raise CaptureError(f"{path} must have at least two rows after its header, not {n}")


def cut(path: Path) -> CaptureError:
    """Return the error of a text whose last line does not end."""
    return CaptureError(
        f"the last line of {path} must end, else its last number may be cut: put a line end there if it is whole"
    )


def blocks(path: Path, source: Lines, header: Header, size: int = BLOCK) -> Iterator[tuple[list[int], list[list[str]]]]:
    """Give blocks of rows as columns of cells, and the line of each row; rows without a cell are left out."""
    separator, names = header.table.separator, header.names
    lines: Iterable[str] = source.rows(header.table.start)
    if separator == " ":
        lines = (" ".join(line.split()) for line in lines)
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True, strict=True)
    number, rows, read = list[int](), list[list[str]](), 0
    widths = range(header.n_cells, len(names) + 1)
    try:
        for row in reader:
            read += 1
            if reader.line_num != read:
                raise CaptureError(f"{path} line {source.number}: a cell must end in its line")
            if len(row) not in widths and not (len(row) == len(names) + 1 and not row[-1].strip()):
                if not any(map(str.strip, row)):
                    continue
                shown = ",".join(names)
                raise CaptureError(
                    f"{path} line {source.number}: a row must have {len(names)} fields ({shown}), not {len(row)}"
                )
            number.append(source.number)
            rows.append(row)
            if len(rows) == size:
                yield number, _columns(rows, separator)
                number, rows = [], []
    except csv.Error as error:
        if "new-line" in str(error):
            raise CaptureError(f"lines of {path} must end in LF or CR LF, not CR") from None
        raise CaptureError(f"{path} line {source.number}: a row must be cells of a CSV: {error}") from None
    if rows:
        yield number, _columns(rows, separator)


def _columns(rows: Sequence[Sequence[str]], separator: str) -> list[list[str]]:
    columns = [[cell.strip() for cell in column] for column in zip(*rows, strict=False)]
    return columns if separator == "," else [[cell.replace(",", ".") for cell in column] for column in columns]


def refuse(
    path: Path,
    line: Sequence[int],
    wrong: NDArray[np.bool_],
    rule: str,
    texts: Sequence[str],
    hint: Callable[[str], str] = lambda _: "",
) -> None:
    """Refuse the first cell that is wrong, if there is one."""
    if wrong.any():
        row = int(np.argmax(wrong))
        raise CaptureError(f"{path} line {line[row]}: {rule}, not {texts[row][:60]!r}{hint(texts[row])}")


class Times:
    """Gives the times of rows, or the numbers of rows without them; they do not decrease.

    `periods` tells that the column has the times since the rows before.
    """

    def __init__(self, path: Path, header: Header, *, periods: bool = False) -> None:
        self._path, self._header, self._periods = path, header, periods
        self._rows, self._last, self._gap, self._offset = 0, float("nan"), 0.0, 0
        self._wraps = dict.fromkeys((*(1 << bits for bits in COUNTERS), _DAY), 0)
        self.whole = True

    def of(self, line: Sequence[int], columns: Sequence[Sequence[str]]) -> NDArray[np.float64]:
        """Return those of a block of rows, in the unit of the column."""
        path, header, n = self._path, self._header, len(line)
        self._rows += n
        if header.time is None:
            return np.arange(self._rows - n, self._rows, dtype=np.float64)
        texts = columns[header.time]
        if header.origin is None:
            time, what = cell_parsers.numbers(texts, self._size), "a number"
        else:
            time = cell_parsers.nanoseconds(texts, header.origin)
            what = "a time of day as in the rows before" if header.clock else "a date and a time as in the rows before"
        refuse(path, line, np.isnan(time), f"{header.names[header.time]} must be {what}", texts)
        latest = _LATEST if header.samplerate_hz is None else _LAST_SAMPLE
        refuse(path, line, np.abs(time) > latest, f"time must be at most {latest:g} {header.unit.name}", texts)
        self.whole &= bool((time == np.rint(time)).all())
        if self._periods:
            refuse(path, line, time < 0, f"{header.names[header.time]} must be at least 0", texts)
            time = np.cumsum(np.append(np.nan_to_num(self._last), time))[1:]
            self._last = float(time[-1])
            return time
        return self._unwrapped(line, time)

    def _size(self, word: str) -> float:
        """Return how many units of the column a unit in a cell is; NaN if it is none."""
        unit = unit_named(word)
        return self._header.unit.per_second / unit.per_second if unit and unit.per_second else float("nan")

    def _unwrapped(self, line: Sequence[int], time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the times with those of a counter that wraps put forward."""
        steps = np.diff(time, prepend=self._last)
        offset = np.full(len(time), float(self._offset))
        for row in np.flatnonzero(steps < 0).tolist():
            gap = max([self._gap, *steps[max(row - 1000, 0) : row]])
            before = time[row] - steps[row]
            modulus = next((1 << bits for bits in COUNTERS if before < 1 << bits), 0) if self.whole else 0
            modulus, most = (_DAY, _DAY / 2) if self._header.clock else (modulus, 4 * gap)
            if not modulus or not 0 <= steps[row] + modulus <= most:
                unit = self._header.unit.name
                raise CaptureError(
                    f"{self._path} line {line[row]}: time must be at least {before} {unit} as before, not {time[row]} "
                    f"{unit}"
                )
            self._wraps[modulus] += 1
            offset[row:] += modulus
        self._last, self._offset, self._gap = float(time[-1]), int(offset[-1]), float(max(self._gap, *steps[-1000:]))
        return time + offset

    @property
    def notes(self) -> list[str]:
        """Return what was made of the times."""
        kinds = {1 << bits: f"as a counter of {bits} bits does" for bits in COUNTERS} | {_DAY: "at midnight"}
        return [f"the time wraps {plural(n, 'time')}, {kinds[modulus]}" for modulus, n in self._wraps.items() if n]
