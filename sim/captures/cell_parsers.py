"""Cells of a text are numbers, times and levels; what is none of these is marked, so that the reader can name it."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import VOLTAGE, read_nearest

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
DATE = re.compile(r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d(?:\.\d{1,9})?)(Z|[+-]\d\d:?\d\d)?", re.ASCII)
HELD, BAD = -1, -2  # in place of a level: the one before holds; there is none in the cell
_LEVELS = {"false": 0, "true": 1, "x": HELD}


class Threshold(NamedTuple):
    """Says from which voltage on a line is high."""

    volts: float
    hysteresis: float = 0.0  # volts: by so much a line must fall below where it rose


def parse_threshold(what: str, text: str) -> Threshold:
    """Read `1.5V` or `1.5V:200mV`; ParameterError if it is none."""
    first, colon, second = text.partition(":")
    hysteresis = read_nearest(what, second, VOLTAGE, "V") if colon else 0.0
    if hysteresis < 0:
        raise ParameterError(what, f"must have a hysteresis of 0 or more, not {second!r}")
    return Threshold(read_nearest(what, first, VOLTAGE, "V"), hysteresis)


def is_value(cell: str) -> bool:
    """Return whether a cell may be in a row, and not a name."""
    return bool(NUMBER.fullmatch(cell) or DATE.fullmatch(cell)) or cell.lower() in _LEVELS


def numbers(cells: Sequence[str]) -> NDArray[np.float64]:
    """Return plain decimal numbers; NaN stands for what is none."""
    if all(map(NUMBER.fullmatch, cells)):
        return np.array(list(map(float, cells)))
    return np.array([float(cell) if NUMBER.fullmatch(cell) else np.nan for cell in cells])


def nanoseconds(cells: Sequence[str], origin: int) -> NDArray[np.float64]:
    """Return times of day with their dates as nanoseconds after another; NaN stands for what is none."""
    dates = [DATE.fullmatch(cell) for cell in cells]
    texts = [f"{date[1]}T{date[2]}" if date else "NaT" for date in dates]
    if len({date[3] for date in dates if date}) > 1:  # the zone of a clock that is put forward
        return np.full(len(cells), np.nan)
    try:
        time = np.array(texts, "datetime64[ns]")
    except ValueError:  # a month 13
        return np.full(len(cells), np.nan)
    return np.where(np.isnat(time), np.nan, (time.astype(np.int64) - origin).astype(np.float64))


def origin_of(cell: str) -> int | None:
    """Return nanoseconds from 1970 to a time of day with its date; None if a cell is none."""
    date = DATE.fullmatch(cell)
    try:
        return None if date is None else int(np.datetime64(f"{date[1]}T{date[2]}", "ns").astype(np.int64))
    except ValueError:
        return None


def levels(cells: Sequence[str]) -> NDArray[np.int8]:
    """Return 0 and 1; HELD where there is an X, BAD where there is another thing."""

    def level(cell: str) -> int:
        known = _LEVELS.get(cell.lower(), BAD)
        number = float(cell) if NUMBER.fullmatch(cell) and not re.match("0[0-9]", cell) else known  # no two in one cell
        return int(number) if number in (0, 1) else known

    return _each(cells, {cell: level(cell) for cell in set(cells)})


def bits(cells: Sequence[str], bit: int) -> NDArray[np.int8]:
    """Return a bit of whole numbers; HELD and BAD as of `levels`."""

    def level(cell: str) -> int:
        if re.fullmatch("[0-9]{1,9}", cell):
            return int(cell) >> bit & 1
        return HELD if cell.lower() == "x" else BAD

    return _each(cells, {cell: level(cell) for cell in set(cells)})


def _each(cells: Sequence[str], of: dict[str, int]) -> NDArray[np.int8]:
    return np.fromiter(map(of.__getitem__, cells), np.int8, len(cells))


def compared(cells: Sequence[str], threshold: Threshold, volts: float) -> NDArray[np.int8]:
    """Return levels of voltages, in units of so many volts; HELD within the hysteresis, and where there is an X."""
    value = numbers(cells) * volts
    level = np.full(len(value), HELD, np.int8)
    level[value >= threshold.volts + threshold.hysteresis / 2] = 1
    level[value < threshold.volts - threshold.hysteresis / 2] = 0
    for row in np.flatnonzero(np.isnan(value)).tolist():
        level[row] = HELD if cells[row].lower() == "x" else BAD
    return level


def held(level: NDArray[np.int8], before: int) -> NDArray[np.int8]:
    """Return levels, each HELD one being that before it, the first one `before`."""
    row = np.maximum.accumulate(np.where(level == HELD, -1, np.arange(len(level))))
    return np.where(row < 0, np.int8(before), level[row])
