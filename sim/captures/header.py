"""The head of a text capture says which columns it has, what separates them, and how its rows are dated."""

import csv
import re
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.file import CaptureError, Channel, OptionError
from tachometry.sim.captures.sigrok import agreed_samplerate, divide, parse_samplerate
from tachometry.spec.language.units import TIME, plain_unit

LONGEST = 1 << 16  # bytes, with the comments before it
COMMENTS = ("#", ";")
# What sigrok calls the time if channels are not called by their names.
_SIGROK = {"samples": "s", "milliseconds": "ms", "microseconds": "us", "nanoseconds": "ns", "picoseconds": "ps"}


@dataclass(frozen=True)
class Header:
    """Holds the head of a text capture.

    Parameters
    ----------
    lines : int
        Of the file, up to the first row.
    separator : str
        `,`, `;` or a tab. With `;` a number may have a decimal comma.
    names : tuple of str
        Of all columns.
    time : int or None
        Column of the times; None: every row is a sample.
    unit : str
        Of the times.
    samplerate_hz : float or None
        For rows that are samples.
    period : int or None
        For files of sigrok, whose times are sample numbers times so many of a unit.
    """

    lines: int
    separator: str
    names: tuple[str, ...]
    time: int | None
    unit: str
    samplerate_hz: float | None
    period: int | None

    @property
    def unit_name(self) -> str:
        """Of the times, for messages."""
        return "seconds" if self.unit == "s" else self.unit

    @property
    def channels(self) -> dict[int, str]:
        """Names of the channels, by their numbers from 0."""
        return dict(enumerate(name for column, name in enumerate(self.names) if column != self.time))

    def column(self, channel: int) -> int:
        """Return the column of a channel."""
        return channel + (self.time is not None and channel >= self.time)

    def seconds(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the first column, or the number of the row, is in seconds; a sample is dated as in a `.sr`."""
        if self.samplerate_hz is None:
            return time / float(1 / TIME[self.unit].size)
        return divide(self._sample(time), self.samplerate_hz, up=False)

    def duration(self, last: float) -> float:
        """Return seconds up to the last row, or to the end of the last sample."""
        if self.samplerate_hz is None:
            return float(self.seconds(np.array([last]))[0])
        return float(divide(self._sample(np.array([last])) + 1, self.samplerate_hz, up=True)[0])

    def _sample(self, time: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.rint(time / (self.period or 1)).astype(np.int64)


def read_header(path: Path, file: BinaryIO, time: Channel | None, samplerate_hz: float | None) -> Header:
    """Read the comments and the line of names with which a text capture begins.

    Parameters
    ----------
    path : Path
        File that messages name.
    file : binary file
        Is read up to the first row.
    time : str, int or None
        Column of the times: its name, else its number among all columns, from 0. None: the one that is named so.
    samplerate_hz : float or None
        For a file that has no times.

    Raises
    ------
    CaptureError
        If there is no such line, or if rows cannot be dated.
    """
    text, comments, lines = _first_line(file)
    if "\r" in text:
        raise CaptureError(f"lines of {path} must end in LF or CR LF, not CR")
    separator = max(",;\t", key=text.count)
    names = [name.strip() for name in next(csv.reader([text], delimiter=separator), [])]
    column = _time_column(path, names, time)
    rest = [number for number in range(len(names)) if number != column]
    if len(set(names)) < len(names):  # sigrok calls each of its lines "logic"
        for number, name in zip(rest, _of_sigrok(comments, r"Channels \([0-9/]+\): (.*)").split(", "), strict=False):
            names[number] = name or names[number]
    shown = text if len(text) <= 60 else text[:60] + "..."
    if (
        len(rest) < (2 if column is None else 1)
        or "" in names
        or len(set(names)) < len(names)
        or all(map(_is_number, names))
    ):
        raise CaptureError(
            f"header of {path} must name the columns, as time,a,b does: one channel at least, each name once, "
            f"not {shown!r}"
        )
    in_file = parse_samplerate(path, _of_sigrok(comments, r"Samplerate: (.*)"))
    if column is None:
        if samplerate_hz is None and in_file is None:
            hint = "or --time or --samplerate must be given"
            raise CaptureError(f"header of {path} must have a column named time, {hint}, not {shown!r}")
        return Header(lines, separator, (*names,), None, "", agreed_samplerate(path, in_file, samplerate_hz), None)
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: its rows have their times")
    if in_file and _of_sigrok(comments, "(CSV generated by libsigrok)"):
        period, unit = _sigrok_period(in_file)
        return Header(lines, separator, (*names,), column, unit, in_file, period)
    return Header(lines, separator, (*names,), column, _unit(path, names[column]), None, None)


def _first_line(file: BinaryIO) -> tuple[str, list[str], int]:
    """Return the first line that is no comment, the comments before it, and how many lines that were."""
    comments: list[str] = []
    left, lines = LONGEST, 0
    while line := file.readline(left):
        left -= len(line)
        lines += 1
        text = line.decode("utf-8-sig", errors="replace").strip()
        if text and not text.startswith(COMMENTS):
            return text, comments, lines
        comments.append(text.lstrip("".join(COMMENTS)).strip())
    return "", comments, lines


def _time_column(path: Path, names: list[str], time: Channel | None) -> int | None:
    plain = [re.split(r"[\[(]", name)[0].strip().casefold() for name in names]
    if time is None:
        return next((k for k, name in enumerate(plain) if name == "time" or name in _SIGROK), None)
    wanted = str(time).strip()
    for alike in (names, [name.casefold() for name in names], plain):
        for word in (wanted, wanted.casefold()):
            if not isinstance(time, int) and word in alike:
                return alike.index(word)
    if wanted.isascii() and wanted.isdigit() and int(wanted) < len(names):
        return int(wanted)
    listed = ", ".join(f"{name} ({number})" for number, name in enumerate(names))
    raise OptionError("time", f"of {path} must be one of the columns {listed}, not {time!r}")


def _unit(path: Path, name: str) -> str:
    """Return the unit in brackets behind a name, else seconds."""
    match = re.search(r"[\[(]\s*(.*?)\s*[\])]$", name)
    unit = plain_unit(match[1]) if match else _SIGROK.get(name.casefold(), "s")
    if unit not in TIME:
        raise CaptureError(f"unit of column {name} of {path} must be one of {', '.join(TIME)}, not {unit!r}")
    return unit


def _of_sigrok(comments: list[str], pattern: str) -> str:
    return next((match[1].strip() for line in comments if (match := re.match(pattern, line))), "")


def _sigrok_period(rate: float) -> tuple[int, str]:
    """Return what sigrok makes of the time between two samples, and its unit: the coarsest that has the samplerate or
    more.

    It is a whole number: 24 MHz has 41 ns, which is off by 1.6 percent. So times divided by it are numbers of samples.
    """
    units = enumerate(_SIGROK.values())
    size, unit = next(((1000**k, unit) for k, unit in units if 1000**k >= rate), (1000**5, "fs"))
    return max(int(size // Fraction(rate)), 1), unit


def _is_number(name: str) -> bool:
    return re.fullmatch(r"[+-]?[0-9.]+(e[+-]?[0-9]+)?", name, re.IGNORECASE) is not None
