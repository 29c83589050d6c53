"""Cells of a text are numbers, times and levels; what is none of these is marked, so that the reader can name it."""

import re
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.time_unit import unit_named
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import VOLTAGE, read_nearest

NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?", re.ASCII)
QUANTITY = re.compile(rf"({NUMBER.pattern})\s*([A-Za-zµμ]+)", re.ASCII)  # a number with its unit
CLOCK = re.compile(r"(\d{1,3}):(\d\d):(\d\d)(?:[.:](\d{1,9}))?", re.ASCII)  # a time of day
DATE = re.compile(r"(\d{4}-\d\d-\d\d)[T ](\d\d:\d\d:\d\d(?:\.\d{1,9})?)(Z|[+-]\d\d:?\d\d)?", re.ASCII)
HELD, BAD = -1, -2  # in place of a level: the one before holds; there is none in the cell
WORDS = {"off": 0, "on": 1, "low": 0, "high": 1, "lo": 0, "hi": 1, "l": 0, "h": 1}
_LEVELS = {"false": 0, "true": 1, "x": HELD, **WORDS}
VOLTS = {"v": 1.0, "volt": 1.0, "volts": 1.0, "mv": 1e-3, "millivolt": 1e-3, "millivolts": 1e-3}


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
    if NUMBER.fullmatch(cell) or DATE.fullmatch(cell) or CLOCK.fullmatch(cell) or cell.lower() in _LEVELS:
        return True
    unit = unit_of(cell)
    return bool(unit) and (unit_named(unit) is not None or unit.casefold() in VOLTS)


def unit_of(cell: str) -> str:
    """Return the unit behind a number; empty if there is none."""
    quantity = QUANTITY.fullmatch(cell)
    return quantity[2] if quantity else ""


def numbers(cells: Sequence[str], size_of: Callable[[str], float] | None = None) -> NDArray[np.float64]:
    """Return decimal numbers, times the size of the unit behind them if it has one; NaN stands for what is none."""
    if all(map(NUMBER.fullmatch, cells)):
        return np.array(list(map(float, cells)))

    def number(cell: str) -> float:
        if NUMBER.fullmatch(cell):
            return float(cell)
        quantity = size_of and QUANTITY.fullmatch(cell)
        return float(quantity[1]) * size_of(quantity[2]) if size_of and quantity else np.nan

    return np.array(list(map(number, cells)))


def _of_day(cell: str) -> int | None:
    """Return the nanoseconds from midnight to a time of day; None if a cell is none."""
    if (clock := CLOCK.fullmatch(cell)) is None or int(clock[2]) > 59 or int(clock[3]) > 59:
        return None
    seconds = (int(clock[1]) * 60 + int(clock[2])) * 60 + int(clock[3])
    return seconds * 10**9 + int((clock[4] or "0").ljust(9, "0"))


def nanoseconds(cells: Sequence[str], origin: int) -> NDArray[np.float64]:
    """Return times of day, all with their dates or all without, as nanoseconds after another; NaN: it is none."""
    if any(map(CLOCK.fullmatch, cells)):
        clocks = [_of_day(cell) for cell in cells]
        return np.array([np.nan if clock is None else float(clock - origin) for clock in clocks])
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
    """Return nanoseconds from 1970, or from midnight, to a time of day with or without a date; None: it is none."""
    if (clock := _of_day(cell)) is not None:
        return clock
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
    value = numbers(cells, lambda unit: VOLTS.get(unit.casefold(), np.nan) / volts) * volts
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
