"""Text (`.csv`) is read as a `Recording`, and written."""

import gzip
import io
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, NoReturn, cast

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import (
    NONE,
    CaptureError,
    Channel,
    check_edges,
    choose_channels,
    named,
    reading,
    writing,
)
from tachometry.sim.captures.header import COMMENTS, Header, read_header
from tachometry.sim.signals import files
from tachometry.sim.signals.recording import Recording

BLOCK = 4 << 20  # bytes of text parsed at once
_COMMENT = re.compile(rb"^[#;].*\n", re.MULTILINE)
# Beyond it a time or the number of a sample is a mistake.
_LATEST, _LAST_SAMPLE = 1e30, 1e15


def read_csv(
    path: str | os.PathLike[str],
    a: Channel | None = None,
    b: Channel | None = None,
    samplerate_hz: float | None = None,
    others: Mapping[str, Channel] = NONE,
    *,
    time: Channel | None = None,
    _block: int = BLOCK,
) -> Recording:
    """Read two to four channels of a text with a line of names, such as `time,a,b`, and levels 0 or 1.

    Rows are change points or samples; rows that change nothing are dropped. Times count from the first row, and the
    last row ends the recording. Each column but that of the time is a channel, in any order, and only those chosen are
    parsed. The time is in seconds, or in the unit that stands in brackets behind its name, as in `Time [us]`. Columns
    are separated by commas, by semicolons (then numbers may have decimal commas) or by tabs. Lines that begin with `;`
    or `#` are comments. Fields are plain numbers, without quotes; lines end in LF or CR LF.

    Without a column of times, a row is a sample, and the last row lasts for its sample, too. What sigrok writes in
    comments is used: the samplerate, and the names of the channels.

    Parameters
    ----------
    path : path
        What ends in `.gz` is compressed by gzip.
    a, b : str, int or None
        Name of the column, else its number, from 0, the time left out. When not given: the columns named A and B (in
        any case) if there are both, else the first two.
    samplerate_hz : float or None, Hz
        Only for a file that has neither times nor a samplerate.
    others : mapping of str to str or int
        Columns of further lines, `z` or `tick_in`, likewise; what is not given, the recording has not.
    time : str, int or None
        Column of the times: its name, else its number among all columns, from 0. When not given: the column named
        `time` (in any case, whatever unit is behind it), if there is one.

    Raises
    ------
    CaptureError
        If the file is missing, empty, or has no line of names; for an unknown channel; if its rows cannot be dated; for
        a row with too few or too many fields, a time that is not a finite number or decreases, or a level that is not
        0 or 1.
    """
    path = Path(path)
    times: list[NDArray[np.float64]] = []
    level: list[NDArray[np.uint8]] = []
    start = last_time = float("nan")
    last_level, n_rows = 255, 0
    with reading(path), _opened(path) as file:
        header = read_header(path, file, time, samplerate_hz)
        numbers = choose_channels(path, header.channels, a, b, others)
        columns = tuple(header.column(number) for number in numbers)
        for line, block in _blocks(file, header.lines + 1, _block):
            block_time, block_lines = _parse(path, line, block, header, columns, n_rows)
            n_rows += len(block_time)
            if not level:
                start = last_time = float(block_time[0])
            before = np.append(last_time, block_time[:-1])
            if (back := np.flatnonzero(block_time < before)).size:
                late, early = before[back[0]], block_time[back[0]]
                raise CaptureError(
                    f"{path} line {line[back[0]]}: time must be at least {late} {header.unit} as before, not {early} "
                    f"{header.unit}"
                )
            block_level = (block_lines @ 2.0 ** np.arange(len(columns))).astype(np.uint8)
            changed = np.diff(block_level, prepend=np.uint8(last_level)) != 0
            times.append(block_time[changed] - start)
            level.append(block_level[changed])
            check_edges(path, sum(map(len, level)))
            last_time, last_level = float(block_time[-1]), int(block_level[-1])
    if not level:
        raise CaptureError(f"{path} must have at least one row after its header, not 0")
    duration = header.duration(last_time - start)
    seconds, lines = header.seconds(np.concatenate(times)), ("a", "b", *others)
    return named(Recording.of_level(seconds, np.concatenate(level), duration, lines), header.channels, numbers)


def _opened(path: Path) -> BinaryIO:
    return cast(BinaryIO, gzip.open(path)) if path.suffix.lower() == ".gz" else path.open("rb")


def write_csv(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write a recording as text with the header `time,a,b`, and `z` and `tick_in` if it has these lines.

    `read_csv`, given the names of these lines, returns the same changes and duration.

    Times are the shortest decimals that read as the same float64, equal on every machine. A last row without a change
    marks the end of the recording.

    Parameters
    ----------
    path : path
        Takes its new content only when all is written.
    recording : Recording

    Raises
    ------
    CaptureError
        If the file cannot be written.
    """
    columns: list[NDArray[np.generic]] = [recording.time + 0.0, *recording.lines.values()]  # no -0.0
    if recording.duration > recording.time[-1]:
        columns = [np.append(column, column[-1]) for column in columns]
        columns[0][-1] = recording.duration
    with writing(Path(path)) as beside:
        files.write_csv(beside, ("time", *recording.lines), files.rows_of(columns))


def _blocks(file: BinaryIO, line: int, size: int) -> Iterator[tuple[NDArray[np.int64], bytes]]:
    """Give blocks of whole rows, and the line of each; comments, and blank lines at the end of the file, go."""
    pending = b""
    while data := file.read(size):
        pending = (pending + data).replace(b"\r\n", b"\n")
        full = pending[: pending.rfind(b"\n") + 1].rstrip(b"\n")
        if full:
            yield from _rows(line, full + b"\n")
            line += full.count(b"\n") + 1
            pending = pending[len(full) + 1 :]
    if last := pending.rstrip(b"\r\n"):
        yield from _rows(line, last + b"\n")


def _rows(line: int, block: bytes) -> Iterator[tuple[NDArray[np.int64], bytes]]:
    text = np.frombuffer(block, np.uint8)
    first = text[np.append(0, np.flatnonzero(text == ord("\n"))[:-1] + 1)]
    is_row = ~np.isin(first, [ord(sign) for sign in COMMENTS])
    if is_row.any():
        yield line + np.flatnonzero(is_row), block if is_row.all() else _COMMENT.sub(b"", block)


def _parse(
    path: Path, line: NDArray[np.int64], block: bytes, header: Header, columns: tuple[int, ...], n_before: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give the times of a block, finite, or the numbers of its rows; and its levels, 0 or 1, a column for each line."""
    names = header.names
    text = np.frombuffer(block, np.uint8)
    newlines = np.flatnonzero(text == ord("\n"))
    n_fields = np.diff(np.searchsorted(np.flatnonzero(text == ord(header.separator)), newlines), prepend=0) + 1
    _refuse(path, line, n_fields != len(names), f"a row must have {len(names)} fields ({','.join(names)})", n_fields)
    if b"\r" in block:
        raise CaptureError(f"lines of {path} must end in LF or CR LF, not CR")
    if header.separator == ";":
        block = block.replace(b",", b".")
    lines = block.decode("utf-8", errors="replace")
    wanted = columns if header.time is None else (header.time, *columns)
    try:
        values = np.loadtxt(io.StringIO(lines), delimiter=header.separator, usecols=wanted, comments=None, ndmin=2)
    except ValueError:
        _name_the_bad_cell(path, line, lines, header, wanted)
    for column, value in zip(columns, values.T[-len(columns) :], strict=True):
        _refuse(path, line, (value != 0) & (value != 1), f"level of {names[column]} must be 0 or 1", value)
    if header.time is None:
        return n_before + np.arange(len(values), dtype=np.float64), values
    time = values[:, 0]
    _refuse(path, line, ~np.isfinite(time), f"time must be a finite number of {header.unit_name}", time)
    latest = _LATEST if header.samplerate_hz is None else _LAST_SAMPLE
    _refuse(path, line, np.abs(time) > latest, f"time must be at most {latest:g} {header.unit}", time)
    return time, values[:, 1:]


def _refuse(
    path: Path, line: NDArray[np.int64], wrong: NDArray[np.bool_], rule: str, values: NDArray[np.generic]
) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        raise CaptureError(f"{path} line {line[row]}: {rule}, not {values[row]:.15g}")


def _name_the_bad_cell(
    path: Path, line: NDArray[np.int64], lines: str, header: Header, columns: tuple[int, ...]
) -> NoReturn:
    for number, row in zip(line, lines.split("\n"), strict=False):
        fields = row.split(header.separator)
        for column in columns:
            try:
                np.loadtxt([fields[column] or "?"], comments=None)
            except ValueError:
                raise CaptureError(
                    f"{path} line {number}: {header.names[column]} must be a number, not {fields[column]!r}"
                ) from None
    raise CaptureError(f"{path} from line {line[0]} on: all fields must be numbers")
