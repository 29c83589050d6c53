"""Text (`.csv`) as a capture: read as a `Recording`, and written."""

import io
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import NONE, CaptureError, Channel, check_edges, choose_channels, reading, writing
from tachometry.sim.signals import files
from tachometry.sim.signals.recording import Recording

BLOCK = 4 << 20  # bytes of text parsed at once
LONGEST_HEADER = 1 << 16  # bytes
_LATEST = 1e30  # seconds


def read_csv(
    path: str | os.PathLike[str],
    a: Channel | None = None,
    b: Channel | None = None,
    samplerate_hz: float | None = None,
    others: Mapping[str, Channel] = NONE,
    *,
    _block: int = BLOCK,
) -> Recording:
    """Read two to four channels of a text with the header `time,a,b`, times in seconds and levels 0 or 1.

    Rows are change points or samples; rows that change nothing are dropped. Times count from the first row, and the
    last row ends the recording. There may be more columns after `time`, or others: each is a channel, and only
    those chosen are parsed. Fields are plain numbers, without quotes; lines end in LF or CR LF.

    Parameters
    ----------
    path : path
    a, b : str, int or None
        Name of the column, else its number, from 0 for the first after `time`. When not given: the columns named A and
        B (in any case) if there are both, else the first two.
    samplerate_hz : None
        Not allowed: a row has its time.
    others : mapping of str to str or int
        Columns of further lines, `z` or `tick_in`, likewise; what is not given, the recording has not.

    Raises
    ------
    CaptureError
        If the file is missing, empty, or has another header; for an unknown channel; for a row with too few or too
        many fields, a time that is not a finite number or decreases, or a level that is not 0 or 1.
    """
    path = Path(path)
    if samplerate_hz is not None:
        raise CaptureError(f"samplerate must not be given for {path}: its rows have their times")
    time: list[NDArray[np.float64]] = []
    level: list[NDArray[np.uint8]] = []
    start = last_time = float("nan")
    last_level = 255
    with reading(path), path.open("rb") as file:
        names = _read_header(path, file)
        columns = (0, *(number + 1 for number in choose_channels(path, dict(enumerate(names[1:])), a, b, others)))
        for line, block in _blocks(file, _block):
            values = _parse(path, line, block, names, columns)
            block_time = values[:, 0]
            if not level:
                start = last_time = float(block_time[0])
            before = np.append(last_time, block_time[:-1])
            if (back := np.flatnonzero(block_time < before)).size:
                late, early = before[back[0]], block_time[back[0]]
                raise CaptureError(
                    f"{path} line {line + back[0]}: time must be at least {late} s as before, not {early} s"
                )
            block_level = (values[:, 1:] @ 2.0 ** np.arange(len(columns) - 1)).astype(np.uint8)
            changed = np.diff(block_level, prepend=np.uint8(last_level)) != 0
            time.append(block_time[changed] - start)
            level.append(block_level[changed])
            check_edges(path, sum(map(len, level)))
            last_time, last_level = float(block_time[-1]), int(block_level[-1])
    if not level:
        raise CaptureError(f"{path} must have at least one row after its header, not 0")
    return Recording.of_level(np.concatenate(time), np.concatenate(level), last_time - start, ("a", "b", *others))


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


def _read_header(path: Path, file: BinaryIO) -> list[str]:
    text = file.readline(LONGEST_HEADER).decode("utf-8-sig", errors="replace").rstrip("\r\n")
    names = [name.strip() for name in text.split(",")]
    if names[0] != "time" or len(names) < 3 or "" in names or len(set(names)) < len(names):
        shown = text if len(text) <= 60 else text[:60] + "..."
        raise CaptureError(f"header of {path} must be time,a,b (or other channels, each name once), not {shown!r}")
    return names


def _blocks(file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    """Give blocks of whole lines, each with the number of its first line; blank lines at the end of the file go."""
    line, pending = 2, b""
    while data := file.read(size):
        pending = (pending + data).replace(b"\r\n", b"\n")
        full = pending[: pending.rfind(b"\n") + 1].rstrip(b"\n")
        if full:
            yield line, full + b"\n"
            line += full.count(b"\n") + 1
            pending = pending[len(full) + 1 :]
    if last := pending.rstrip(b"\r\n"):
        yield line, last + b"\n"


def _parse(path: Path, line: int, block: bytes, names: list[str], columns: tuple[int, ...]) -> NDArray[np.float64]:
    """Give time and levels of a block as an array of a column each, all finite, levels 0 or 1."""
    text = np.frombuffer(block, np.uint8)
    commas_before = np.searchsorted(np.flatnonzero(text == ord(",")), np.flatnonzero(text == ord("\n")))
    n_fields = np.diff(commas_before, prepend=0) + 1
    _refuse(path, line, n_fields != len(names), f"a row must have {len(names)} fields ({','.join(names)})", n_fields)
    if b"\r" in block:
        raise CaptureError(f"lines of {path} must end in LF or CR LF, not CR")
    lines = block.decode("utf-8", errors="replace")
    try:
        values = np.loadtxt(io.StringIO(lines), delimiter=",", usecols=columns, comments=None, ndmin=2)
    except ValueError:
        _name_the_bad_cell(path, line, lines, names, columns)
    time = values[:, 0]
    _refuse(path, line, ~np.isfinite(time), "time must be a finite number of seconds", time)
    _refuse(path, line, np.abs(time) > _LATEST, f"time must be at most {_LATEST:g} s", time)
    for column, value in zip(columns[1:], values.T[1:], strict=True):
        _refuse(path, line, (value != 0) & (value != 1), f"level of {names[column]} must be 0 or 1", value)
    return values


def _refuse(path: Path, line: int, wrong: NDArray[np.bool_], rule: str, values: NDArray[np.generic]) -> None:
    if wrong.any():
        row = int(np.argmax(wrong))
        raise CaptureError(f"{path} line {line + row}: {rule}, not {values[row]:.15g}")


def _name_the_bad_cell(path: Path, line: int, lines: str, names: list[str], columns: tuple[int, ...]) -> NoReturn:
    for number, row in enumerate(lines.split("\n")[:-1], line):
        fields = row.split(",")
        for column in columns:
            try:
                np.loadtxt([fields[column] or "?"], comments=None)
            except ValueError:
                raise CaptureError(
                    f"{path} line {number}: {names[column]} must be a number, not {fields[column]!r}"
                ) from None
    raise CaptureError(f"{path} from line {line} on: all fields must be numbers")
