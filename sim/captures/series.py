"""A column of numbers in a text is read against the times of its rows."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.cell_parsers import numbers
from tachometry.sim.captures.file import CaptureError, Channel, OptionError, check_edges, kind_of, reading
from tachometry.sim.captures.header import Header, TextOptions, check_seconds, read_header
from tachometry.sim.captures.rows import Lines, Times, blocks, check_rows, opened, refuse
from tachometry.sim.captures.time_unit import parted
from tachometry.spec.language.units import ANGLE, SPEED

Floats = NDArray[np.float64]
_MOST = 1 << 53  # counts that a number of a spreadsheet holds
_SLOWEST = 1.0  # seconds between two rows of a log, unless their times have a unit
# rad, or rad/s, in the units that a column of angles or speeds may have
ANGLES = {name: float(unit.exact) for name, unit in ANGLE.items()} | {"turn": 2 * math.pi}
SPEEDS = {name: float(unit.exact) for name, unit in SPEED.items()} | {"deg/s": ANGLES["deg"]}
_ALIKE = {
    "deg": "degree degrees",
    "turn": "turns rev revs revolution revolutions rotation rotations",
    "rad": "radian radians",
    "rad/s": "rads rad/sec radian/s radians/s",
    "rev/s": "rps r/s turn/s turns/s revs/s",
    "rpm": "r/min rev/min turns/min 1/min",
    "deg/s": "dps degree/s degrees/s",
}
_UNIT_OF = {word: unit for unit, words in _ALIKE.items() for word in (unit, *words.split())} | {"mrad": "mrad"}
_ENDING = re.compile(rf"(?:.*[\s_./-])?({'|'.join(map(re.escape, sorted(_UNIT_OF, key=len, reverse=True)))})")


@dataclass(frozen=True)
class Series:
    """Holds a column of a text."""

    time: Floats  # shape (n,), seconds, strictly increasing, first entry 0
    value: Floats  # shape (n,)
    name: str  # of the column
    notes: tuple[str, ...]  # how the rows were understood


def unit_named(text: str) -> str:
    """Return the unit of angles or speeds that is called so; empty if there is none."""
    return _UNIT_OF.get(text.strip("[]() ").casefold(), "")


def unit_in(header: Header, column: int) -> str:
    """Return the unit of the angles or speeds of a column, by its line of units or its name; empty if it has none."""
    if unit := unit_named(header.unit_of(column)):
        return unit
    name = header.names[column].casefold()
    ending = _ENDING.fullmatch(name) or _ENDING.fullmatch(re.sub(r"_(s|sec|min)$", r"/\1", name))
    return _UNIT_OF[ending[1]] if ending else ""


def column_of(path: Path, header: Header, wanted: Channel, what: str) -> int:
    """Return the number of a column that is called so; OptionError of the option `what` if there is none."""
    names, text = [name.casefold() for name in header.names], str(wanted).strip()
    bare = [" " if number == header.time else parted(name)[0] for number, name in enumerate(names)]
    for alike in (header.names, names, bare):
        if text in alike or text.casefold() in alike:
            return alike.index(text if text in alike else text.casefold())
    if text.isascii() and text.isdigit() and int(text) < len(names):
        return int(text)
    listed = ", ".join(f"{name} ({number})" for number, name in enumerate(header.names))
    raise OptionError(what, f"of {path} must be one of the columns {listed}, not {wanted!r}")


def read_series(
    path: Path, wanted: Channel | None, what: str, text: TextOptions, *, whole: bool = False
) -> tuple[Series, str]:
    """Return a column of a text whose head is that of `read_csv`, and its unit; rows of one time are one, the last.

    `wanted` is its name, or its number from 0; None: the first with a unit of angles or speeds. `what` is the option
    that names it, for messages. It raises CaptureError if the file cannot be read, or a number is none, or not `whole`.
    """
    if kind_of(path) in (".sr", ".vcd", ".fst"):
        raise OptionError(what, f"must not be given for {path}: it has levels, not numbers")
    with reading(path), opened(path) as file:
        source = Lines(path, file)
        header = read_header(path, source.head, text, None)
        if header.time is None:
            raise OptionError("time", f"must be given for {path}: its rows must have times")
        column = _with_unit(path, header) if wanted is None else column_of(path, header, wanted, what)
        times = Times(path, header)
        parts = [
            np.stack([times.of(line, columns), _values(path, line, header.names[column], columns[column], whole)])
            for line, columns in blocks(path, source, header)
        ]
    rows = np.concatenate([np.zeros((2, 0)), *parts], axis=1).T
    check_rows(path, source, len(rows))
    seconds, notes = header.seconds(rows[:, 0] - rows[0, 0]), times.notes
    last = np.append(np.diff(seconds) > 0, True)
    if len(again := np.flatnonzero(~last)):
        notes.insert(0, f"{len(again)} rows have the time of the next one, which holds")
    seconds = seconds[last]
    if len(seconds) < 2:
        raise CaptureError(f"times of {path} must not all be equal")
    slow = text.slowest_s and max(text.slowest_s, _SLOWEST)
    check_seconds(path, header, slow, np.diff(seconds), "rows", whole=times.whole)
    return Series(seconds, rows[last, 1], header.names[column], tuple(notes)), unit_in(header, column)


def wraps_at(angle: Floats, turn: float) -> bool:
    """Return whether angles wrap at a turn: all are within one, and some steps are more than half of it."""
    least, most = angle.min(), angle.max()
    within = -0.51 * turn <= least <= most <= 0.51 * turn or -0.01 * turn <= least <= most <= 1.01 * turn
    return bool(within and np.abs(np.diff(angle)).max() > turn / 2)


def _with_unit(path: Path, header: Header) -> int:
    found = [column for column in range(len(header.names)) if column != header.time and unit_in(header, column)]
    if not found:
        units = ", ".join((*SPEEDS, *ANGLES))
        raise CaptureError(
            f"{path} must have a column with a unit in its name, as speed_rpm: one of {units}, not "
            f"{','.join(header.names)!r}; a log of counts is counts:{path}:TIME:COUNT"
        )
    return found[0]


def _values(path: Path, line: Sequence[int], name: str, texts: Sequence[str], whole: bool) -> Floats:
    """Return the numbers of a block of rows."""
    value = numbers(texts)
    check_edges(path, line[-1])
    if whole:
        wrong, rule = ~(np.abs(value) <= _MOST) | (value != np.rint(value)), "a whole number up to 2^53"
    else:
        wrong, rule = ~(np.abs(value) < np.inf), "a finite number"
    refuse(path, line, wrong, f"{name} must be {rule}", texts)
    return value
