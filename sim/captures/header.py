"""The head of a text says which columns it has, what separates them, and how its rows are dated."""

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures.cell_parsers import BAD, CLOCK, NUMBER, VOLTS, Threshold, levels, origin_of, unit_of
from tachometry.sim.captures.file import CaptureError, Channel, OptionError
from tachometry.sim.captures.sigrok import agreed_samplerate, divide, parse_samplerate
from tachometry.sim.captures.text_layout import Table, bare, is_comment, names_times, sniff, trimmed
from tachometry.sim.captures.time_unit import TimeUnit, parted, rank, unit_named
from tachometry.spec.language.units import TIME


@dataclass(frozen=True)
class TextOptions:
    """How a text is read, where it does not say it; columns are names, or numbers from 0."""

    time: Channel | None = None  # column of the times; None: the one that is named so
    unit: TimeUnit | None = None  # of the times; None: as their name says, else seconds
    threshold: Threshold | None = None  # of columns that are voltages; None: they are levels, 0 or 1
    # seconds: edges further apart are taken for a mistake where nothing says the unit of the times
    slowest_s: float | None = None
    pulse_times: Channel | None = None  # the column in place of `time`, of a text that has a row for each pulse
    pulse_periods: Channel | None = None  # likewise, of the times since the pulse before


PLAIN = TextOptions()


@dataclass(frozen=True)
class Header:
    """Holds the head of a text capture."""

    table: Table
    names: tuple[str, ...]  # of all columns; the first may have none
    time: int | None  # column of the times; None: every row is a sample
    unit: TimeUnit  # of the times
    assumed: bool = False  # whether nothing says the unit
    samplerate_hz: float | None = None  # for rows that are samples
    period: int | None = None  # for files of sigrok, whose times are sample numbers times so many of a unit

    @property
    def _first(self) -> str:
        """Time in the first row, as it is written there."""
        in_first = self.time is not None and self.time < len(self.table.first)
        return self.table.first[self.time or 0].replace(",", ".") if in_first else ""

    @property
    def origin(self) -> int | None:
        """Nanoseconds from 1970, or from midnight, to the first row, if it has a time of day."""
        return origin_of(self._first)

    @property
    def clock(self) -> bool:
        """Whether times are times of day without a date."""
        return CLOCK.fullmatch(self._first) is not None

    @property
    def n_cells(self) -> int:
        """Cells of a row: one for each name, but for names that are the start and the step of an oscilloscope."""
        return len(self.names) - _n_constants(self.names, self.table)

    def unit_of(self, column: int) -> str:
        """Return the unit of a column: in its name, or in the line of units."""
        return parted(self.names[column])[1] or bare(self.table.units[column] if column < len(self.table.units) else "")

    @property
    def _columns(self) -> list[int]:
        return [column for column, name in enumerate(self.names) if name and column != self.time]

    @property
    def channels(self) -> dict[int, str]:
        """Names of the channels, by their numbers from 0."""
        return {channel: self.names[column] for channel, column in enumerate(self._columns)}

    def column(self, channel: int) -> int:
        """Return the column of a channel."""
        return self._columns[channel]

    def volts(self, column: int) -> float:
        """Return how many volts the unit of a column is."""
        return VOLTS.get(bare(self.unit_of(column)), 1.0)

    def seconds(self, time: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the times, or the numbers of the rows, are in seconds; a sample is dated as in a `.sr`."""
        if self.samplerate_hz is None:
            return time / self.unit.per_second
        return divide(self._sample(time), self.samplerate_hz, up=False)

    def duration(self, last: float) -> float:
        """Return seconds up to the last row, or to the end of the last sample."""
        if self.samplerate_hz is None:
            return float(self.seconds(np.array([last]))[0])
        return float(divide(self._sample(np.array([last])) + 1, self.samplerate_hz, up=True)[0])

    def _sample(self, time: NDArray[np.float64]) -> NDArray[np.int64]:
        return np.rint(time / (self.period or 1)).astype(np.int64)


def read_header(path: Path, lines: Sequence[str], options: TextOptions, samplerate_hz: float | None) -> Header:
    """Read what stands above the rows of a text, of its first lines; `samplerate_hz` is for a file that has no times.

    It raises CaptureError if columns have no names, nor numbers that are given, or if rows cannot be dated.
    """
    table = sniff(lines, options.time)
    one_column = table is not None and len(table.names or table.first) == 1
    first = next((line.strip() for line in lines if not is_comment(line)), "")
    shown = first if len(first) <= 60 else first[:60] + "..."
    if table is None or (table.names is not None and not _are_names(table, options.time)):
        raise CaptureError(
            f"header of {path} must name the columns, as time,a,b does: one channel at least, each name once, "
            f"not {shown!r}"
        )
    if table.names is None and options.time is None and samplerate_hz is None:
        line, columns = ("time_us", "--pulse-times 0") if one_column else ("time,a,b", "--time 0 --a 1 --b 2")
        raise CaptureError(
            f"{path} has no line of names: put one such as {line} before its rows, or give its columns by number, as "
            f"{columns}"
        )
    names = _names(table)
    column = _time_column(path, names, table, options.time)
    in_file = parse_samplerate(path, _of_sigrok(table.comments, r"Samplerate: (.*)")) or _increment(names)
    if column is None:
        if samplerate_hz is None and in_file is None:
            rows = zip(names, table.first, strict=False)
            times = [name for name, cell in rows if levels([cell])[0] == BAD or re.search("[.,]", cell)]
            hint = f"or {f'--time {shlex.quote(times[0])}' if times else '--time or --samplerate'} must be given"
            raise CaptureError(f"header of {path} must have a column named time, {hint}, not {shown!r}")
        if options.unit is not None:
            raise OptionError("time_unit", f"must not be given for {path}: it has no times")
        rate = agreed_samplerate(path, in_file, samplerate_hz)
        return Header(table, names, None, TimeUnit("samples", rate), samplerate_hz=rate)
    if samplerate_hz is not None:
        raise OptionError("samplerate", f"must not be given for {path}: its rows have their times")
    if in_file and _of_sigrok(table.comments, "(CSV generated by libsigrok)"):
        period, name = _sigrok_period(in_file)
        return Header(table, names, column, TimeUnit(name, 0), samplerate_hz=in_file, period=period)
    unit, assumed = _unit(path, table, names, column, options.unit)
    return Header(table, names, column, unit, assumed)


def _are_names(table: Table, time: Channel | None) -> bool:
    """Return whether the names are some: one for each column, and no numbers unless the times are named beside them."""
    names = _names(table)
    if not names_times(names, time):
        extra = len(table.first) - len(names) + _n_constants(names, table)
        if any(map(NUMBER.fullmatch, names)) or (table.first and extra not in (0, 1)):
            return False
    return "" not in names[1:] and len({*names}) == len(names)


def _n_constants(names: Sequence[str], table: Table) -> int:
    """Return how many names at the end have no cells in the first row, as they are values of an oscilloscope."""
    beyond = names[len(table.first) :] if len(table.first) > 1 else ()
    constants = all(name.casefold().startswith(("t0", "tinc", "start", "increment")) for name in beyond)
    return len(beyond) if constants else 0


def _names(table: Table) -> tuple[str, ...]:
    """Return names of all columns, those of sigrok's comment if it calls each line "logic", else their numbers."""
    if table.names is None:
        return tuple(map(str, range(len(trimmed(table.first)))))
    names = list(table.names)
    if len({*names}) < len(names):
        rest = [column for column, name in enumerate(names) if rank(name) is None]
        listed = _of_sigrok(table.comments, r"Channels \([0-9/]+\): (.*)").split(", ")
        for column, name in zip(rest, listed, strict=False):
            names[column] = name or names[column]
    return tuple(names)


def _time_column(path: Path, names: Sequence[str], table: Table, time: Channel | None) -> int | None:
    if time is None:
        ranked = [(likely, column) for column, name in enumerate(names) if (likely := rank(name)) is not None]
        dated = [column for column, cell in enumerate(table.units) if unit_named(bare(cell))]
        return min(ranked)[1] if ranked else dated[0] if dated else None
    wanted = str(time).strip()
    plain = [parted(name)[0].casefold() for name in names]
    for alike in (names, [name.casefold() for name in names], plain):
        for word in (wanted, wanted.casefold()):
            if not isinstance(time, int) and word and word in alike:
                return alike.index(word)
    if wanted.isascii() and wanted.isdigit() and int(wanted) < len(names):
        return int(wanted)
    listed = ", ".join(f"{name} ({number})" for number, name in enumerate(names))
    raise OptionError("time", f"of {path} must be one of the columns {listed}, not {time!r}")


def _unit(path: Path, table: Table, names: Sequence[str], column: int, given: TimeUnit | None) -> tuple[TimeUnit, bool]:
    """Return the unit of the times, and whether it is a guess."""
    word = parted(names[column])[1] or (bare(table.units[column]) if column < len(table.units) else "")
    unit = given or (unit_named(word) if word else TimeUnit("s", 1.0))
    first = table.first[column].replace(",", ".") if column < len(table.first) else ""
    if origin_of(first) is not None:
        if given is not None:
            raise OptionError("time_unit", f"must not be given for {path}: its times are times of day")
        return TimeUnit("ns", 1e9), False
    if unit_named(unit_of(first)) and (unit is None or not unit.per_second):
        return TimeUnit("s", 1.0), False
    if unit is None:
        units = ", ".join(TIME)
        raise CaptureError(f"unit of column {names[column]} of {path} must be one of {units}, not {word!r}")
    increments = [
        table.units[k] for k, name in enumerate(names) if name.casefold() == "increment" and k < len(table.units)
    ]
    if not unit.per_second and increments and NUMBER.fullmatch(increments[0]) and float(increments[0]) > 0:
        unit = TimeUnit(unit.name, 1 / float(increments[0]))
    if not unit.per_second:
        raise OptionError("time_unit", f"must be given for {path}: the rate of {names[column]}, such as 16MHz")
    return unit, given is None and not word and not unit_of(first)


def check_seconds(
    path: Path, header: Header, slowest_s: float | None, distances: NDArray[np.float64], what: str, *, whole: bool
) -> None:
    """Check that times, of which nothing says the unit, make sense as seconds.

    `distances`, a float64 array in seconds, are between edges, or whatever they date, `what`. `whole` tells whether all
    times are whole numbers.
    """
    if not header.assumed or slowest_s is None or not distances.size:
        return
    median = float(np.median(distances))
    if median > slowest_s or (whole and median):
        raise OptionError(
            "time_unit",
            f"must be given for {path}: as seconds, its {what} would be {median:.4g} s apart; it is s, ms, us, ns or "
            "the rate of what counts the time, such as 16MHz",
        )


def _of_sigrok(comments: Sequence[str], pattern: str) -> str:
    return next((match[1].strip() for line in comments if (match := re.match(pattern, line))), "")


def _increment(names: Sequence[str]) -> float | None:
    """Return the samplerate of an oscilloscope that writes `tInc = 1e-06` among the names."""
    matches = (re.fullmatch(rf"tInc\s*=\s*({NUMBER.pattern})s?", name) for name in names)
    return next((1 / float(match[1]) for match in matches if match and float(match[1]) > 0), None)


def _sigrok_period(rate: float) -> tuple[int, str]:
    """Return what sigrok makes of the time between two samples, and its unit: the coarsest that has the samplerate or
    more.

    It is a whole number: 24 MHz has 41 ns, which is off by 1.6 percent. So times divided by it are numbers of samples.
    """
    units = enumerate(("s", "ms", "us", "ns", "ps"))
    size, unit = next(((1000**k, unit) for k, unit in units if 1000**k >= rate), (1000**5, "fs"))
    return max(int(size // Fraction(rate)), 1), unit
