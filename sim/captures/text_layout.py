"""Where a text has its names, its units and its rows is found from its first lines alone."""

import csv
from collections.abc import Sequence
from typing import NamedTuple

from tachometry.sim.captures.cell_parsers import NUMBER, is_value
from tachometry.sim.captures.file import Channel
from tachometry.sim.captures.time_unit import parted, rank, unit_named

COMMENTS = ("#", ";")
MARK = "MARK"  # what loggers of engines write for a key that was pressed
SEPARATORS = (",", ";", "\t", " ")
VOLTS = {"v": 1.0, "volt": 1.0, "volts": 1.0, "mv": 1e-3, "millivolt": 1e-3, "millivolts": 1e-3}


class Table(NamedTuple):
    """Holds where the rows of a text begin, and what is above them."""

    separator: str  # one of `SEPARATORS`; but for the comma, numbers may have a decimal comma
    names: list[str] | None  # of the columns; None: there are none
    units: list[str]  # what stands in a line of units below the names; as many, or none
    start: int  # lines before the first row
    comments: list[str]  # lines before it that are comments
    first: list[str]  # cells of the first row; empty if there is none


def split(line: str, separator: str) -> list[str]:
    """Return the cells of a line; none if it cannot be split."""
    if separator == " ":
        line = " ".join(line.split())
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])]
    except csv.Error:
        return []


def is_comment(line: str) -> bool:
    """Return whether a line is neither names nor a row."""
    text = line.strip()
    return not text or text.startswith((*COMMENTS, MARK))


def sniff(lines: Sequence[str], time: Channel | None = None) -> Table | None:
    """Find names, units and rows among the first lines of a text.

    Names are in the last line above the first row that names the times, else in the line right above it, which may be
    a comment. Whatever is between names and rows must be a row, but for a line of units. None if nothing is found.
    """
    tables = [table for separator in SEPARATORS if (table := _with(separator, lines, time)) is not None]
    return max(tables, key=lambda table: bool(table.names) + bool(table.first), default=None)


def _with(separator: str, lines: Sequence[str], time: Channel | None) -> Table | None:
    """Return the table that lines are with this separator; None if they are none."""
    plain = [number for number, line in enumerate(lines) if not is_comment(line)]
    cells = {number: split(lines[number], separator) for number in plain}
    first = next((number for number in plain if _is_row(cells[number], separator)), len(lines))
    above = [number for number in plain if number < first]
    commented = {n: split(lines[n].lstrip("".join(COMMENTS)), separator) for n in range(first) if n not in cells}
    named = [number for number in above if names_times(cells[number], time)]
    in_comments = [number for number, row in commented.items() if names_times(row, time)]
    at, row = -1, None
    if named or above:
        at = (named or above)[-1]
        row = cells[at]
    elif in_comments:
        at, row = in_comments[-1], commented[in_comments[-1]]
    if first == len(lines) and not named:
        return None
    return _table(separator, lines, cells, at, row)


def _table(
    separator: str, lines: Sequence[str], cells: dict[int, list[str]], at: int, names: list[str] | None
) -> Table | None:
    """Return the table whose names are in line `at`, or that has none."""
    below = [number for number in cells if number > at]
    before = [number for number in cells if number < at and names and _as_many(names, cells[number])]
    units: list[str] = []
    if names and at in cells and before and _are_units(names):
        units, names = names, cells[before[-1]]  # it is the line of units that looks as names of times do
    elif names and below and _as_many(cells[below[0]], names) and _are_units(cells[below[0]]):
        units = cells[below.pop(0)]
    names = names and trimmed(names)
    start = below[0] if below else len(lines)
    if len(names or cells.get(start, [])) < 2:
        return None
    comments = [line.strip().lstrip("".join(COMMENTS)).strip() for line in lines[:start] if is_comment(line)]
    return Table(separator, names, units, start, comments, cells.get(start, []))


def trimmed(cells: list[str]) -> list[str]:
    """Return the cells without an empty one at the end, behind a comma too many."""
    return cells[:-1] if cells and not cells[-1] else cells


def _as_many(units: list[str], names: list[str]) -> bool:
    """Return whether a line has a cell for each name, and nothing where there is no name."""
    as_many = len(units) == len(names) or len(trimmed(units)) == len(trimmed(names))
    return as_many and not any(units[len(trimmed(names)) :])


def _is_row(cells: Sequence[str], separator: str) -> bool:
    """Return whether a line looks as a row does: it begins with a value, and most of its cells are values."""
    if separator != ",":
        cells = [cell.replace(",", ".") for cell in cells]
    values = [cell for cell in cells if is_value(cell)]
    filled = [cell for cell in cells if cell]
    begins = bool(cells) and (not cells[0] or is_value(cells[0])) and all(rank(cell) is None for cell in filled)
    return begins and len(values) > 1 and 2 * len(values) > len(filled)


def names_times(cells: Sequence[str], time: Channel | None) -> bool:
    """Return whether a line names the times: as is usual, or as it was asked for."""
    wanted = time.strip().casefold() if isinstance(time, str) else None
    alike = (wanted in (name.casefold(), parted(name)[0].casefold()) for name in cells if name)
    return len(cells) > 1 and (any(rank(name) is not None for name in cells) or (bool(wanted) and any(alike)))


def _are_units(cells: Sequence[str]) -> bool:
    """Return whether a line is of units; numbers may be among them, as the increment of an oscilloscope."""
    words = [bare(cell) for cell in cells if cell and not NUMBER.fullmatch(cell)]
    return bool(words) and all(unit_named(word) or word in VOLTS for word in words)


def bare(cell: str) -> str:
    """Return a unit without the brackets around it."""
    return cell.strip("[]() ").casefold()
