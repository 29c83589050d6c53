"""Where a text has its names, its units and its rows is found from its first lines alone."""

import csv
from collections.abc import Sequence
from typing import NamedTuple

from tachometry.sim.captures.cell_parsers import NUMBER, VOLTS, WORDS, is_value
from tachometry.sim.captures.file import Channel
from tachometry.sim.captures.time_unit import parted, rank, unit_named

COMMENTS = ("#", ";")
MARK = "MARK"  # what loggers of engines write for a key that was pressed
SEPARATORS = (",", ";", "\t", " ")


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
    if text.count('"') == 2 and text[0] == text[-1]:  # a single cell in quotes
        text = text[1:-1]
    return not text or text.startswith((*COMMENTS, MARK))


def sniff(lines: Sequence[str], time: Channel | None = None) -> Table | None:
    """Find names, units and rows among the first lines of a text.

    Names are in the last line above the first row that names the times, else in the line right above it, which may be
    a comment. Whatever is between names and rows must be a row, but for a line of units. None if nothing is found.
    """
    if _one_column(lines):
        return _with(",", lines, time, 1)
    tables = [table for separator in SEPARATORS if (table := _with(separator, lines, time)) is not None]
    return max(tables, key=lambda table: bool(table.names) + bool(table.first), default=None)


def _one_column(lines: Sequence[str]) -> bool:
    """Return whether the rows have a single cell: whatever follows the first one is another."""
    plain = [is_value(line.strip().strip('"')) for line in lines if not is_comment(line)]
    return any(plain) and all(plain[plain.index(True) :])


def _with(separator: str, lines: Sequence[str], time: Channel | None, least: int = 2) -> Table | None:
    """Return the table that lines are with this separator, of so many columns at least; None if they are none."""
    plain = [number for number, line in enumerate(lines) if not is_comment(line)]
    cells = {number: split(lines[number], separator) for number in plain}
    first = next((number for number in plain if _is_row(cells[number], separator, least)), len(lines))
    above = [number for number in plain if number < first]
    commented = {n: split(lines[n].lstrip("".join(COMMENTS)), separator) for n in range(first) if n not in cells}
    named = [number for number in above if names_times(cells[number], time, least)]
    in_comments = [number for number, row in commented.items() if names_times(row, time, least)]
    at, row = -1, None
    if named or above:
        at = (named or above)[-1]
        row = cells[at]
    elif in_comments:
        at, row = in_comments[-1], commented[in_comments[-1]]
    if first == len(lines) and not named:
        return None
    table = _table(separator, lines, cells, at, row, time)
    return table if len(table.names or table.first) >= least else None


def _table(
    separator: str,
    lines: Sequence[str],
    cells: dict[int, list[str]],
    at: int,
    names: list[str] | None,
    time: Channel | None,
) -> Table:
    """Return the table whose names are in line `at`, or that has none."""
    below = [number for number in cells if number > at]
    before = [number for number in cells if number < at and names and _as_many(names, cells[number])]
    units: list[str] = []
    if names and at in cells and before and _are_units(names, cells[before[-1]], time):
        units, names = names, cells[before[-1]]  # it is the line of units that looks as names of times do
    elif names and below and _as_many(cells[below[0]], names):
        words = cells[below[0]]
        rows = len(below) > 1 and _is_row(cells[below[1]], separator, 1)
        if _are_units(words, names, time) or (rows and any(words) and not any(map(is_value, words))):
            units = cells[below.pop(0)]
    names = names and trimmed(names)
    start = below[0] if below else len(lines)
    comments = [line.strip().lstrip("".join(COMMENTS)).strip() for line in lines[:start] if is_comment(line)]
    return Table(separator, names, units, start, comments, cells.get(start, []))


def trimmed(cells: list[str]) -> list[str]:
    """Return the cells without an empty one at the end, behind a comma too many."""
    return cells[:-1] if cells and not cells[-1] else cells


def _as_many(units: list[str], names: list[str]) -> bool:
    """Return whether a line has a cell for each name, and nothing where there is no name."""
    as_many = len(units) == len(names) or len(trimmed(units)) == len(trimmed(names))
    return as_many and not any(units[len(trimmed(names)) :])


def _is_row(cells: Sequence[str], separator: str, least: int) -> bool:
    """Return whether a line looks as a row does: it begins with a value, and most of its cells are values."""
    if separator != ",":
        cells = [cell.replace(",", ".") for cell in cells]
    values = [cell for cell in cells if is_value(cell)]
    filled = [cell for cell in cells if cell]
    if len(values) < len(filled):  # among words, On is one
        values = [cell for cell in values if cell.lower() not in WORDS]
    begins = bool(cells) and (not cells[0] or is_value(cells[0])) and all(rank(cell) is None for cell in filled)
    return begins and len(values) >= least and 2 * len(values) > len(filled)


def names_times(cells: Sequence[str], time: Channel | None, least: int = 2) -> bool:
    """Return whether a line names the times: as is usual, or as it was asked for."""
    return len(cells) >= least and any(_is_of_times(name, time) for name in cells)


def _is_of_times(name: str, time: Channel | None) -> bool:
    wanted = time.strip().casefold() if isinstance(time, str) else ""
    alike = bool(name and wanted) and wanted in (name.casefold(), parted(name)[0].casefold())
    return rank(name) is not None or alike


def _are_units(cells: Sequence[str], names: Sequence[str], time: Channel | None) -> bool:
    """Return whether a line has the units of these columns: of times and volts, or any words if the times have theirs.

    Numbers may be among them, as the increment of an oscilloscope.
    """
    words = [bare(cell) for cell in cells if cell and not NUMBER.fullmatch(cell)]
    if words and all(unit_named(word) or word in VOLTS for word in words):
        return True
    pairs = zip(names, map(bare, cells), strict=False)
    return any(_is_of_times(name, time) and (unit_named(word) or word[:3] == "hh:") for name, word in pairs)


def bare(cell: str) -> str:
    """Return a unit without the brackets around it."""
    return cell.strip("[]() ").casefold()
