"""Text (`.csv` and its like) is read as a `Recording`, and written."""

import os
import re
import shlex
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.captures import cell_parsers
from tachometry.sim.captures.file import (
    ANY,
    SAME,
    CaptureError,
    Channels,
    Line,
    OptionError,
    check_edges,
    choose_channels,
    flow_of,
    position,
    reading,
    source_of,
    writing,
)
from tachometry.sim.captures.header import PLAIN, Header, TextOptions, check_seconds, read_header
from tachometry.sim.captures.rows import BLOCK, Lines, Times, blocks, check_rows, cut, opened, refuse
from tachometry.sim.captures.series import ANGLES, unit_in
from tachometry.sim.captures.text_layout import split
from tachometry.sim.signals import files
from tachometry.sim.signals.flow import Flow, Part, Parts
from tachometry.sim.signals.recording import Recording, packed
from tachometry.sim.signals.source import Source
from tachometry.spec.language.units import plural

_FILES = {"--trace": "interval,forced,velocity_raw", "--counts": "tick,pulse_count", "--events": "clock,event"}


def read_csv(
    path: str | os.PathLike[str],
    wanted: Channels = ANY,
    samplerate_hz: float | None = None,
    options: TextOptions = PLAIN,
    *,
    _block: int | None = None,
) -> Flow:
    """Read two to four channels of a text with a line of names, such as `time,a,b`, and levels, see
    docs/guides/captures.md.

    Rows are change points or samples; rows that change nothing are dropped. Times count from the first row in which all
    levels are known, and the last row ends the recording. Without a column of times, a row is a sample, and the last
    row lasts for its sample, too. Rows are pulses if `options` say so, or if there are only times.

    A channel is the name of a column or its number from 0, the time left out; `state[1]` is bit 1 of the whole numbers
    in a column. Other arguments are as of `read_sr`. It raises CaptureError for a file or a row that is none of this.
    """
    path = Path(path)
    return flow_of(path, wanted, _parts(path, wanted, samplerate_hz, options, _block or BLOCK))


def _parts(path: Path, wanted: Channels, samplerate_hz: float | None, options: TextOptions, block: int) -> Parts:
    if (own := options.pulse_periods if options.pulse_times is None else options.pulse_times) is not None:
        options = replace(options, time=own)
    with reading(path), opened(path) as file:
        source = Lines(path, file)
        for option in (name for name, columns in _FILES.items() if any(columns in line for line in source.head[:1])):
            raise CaptureError(f"{path} has outputs of a core, from {option}: replay what --save-capture wrote")
        header = read_header(path, source.head, options, samplerate_hz)
        if own is not None or not header.channels:
            pulses = _pulses(path, source, header, options, one_line=wanted.b == SAME)
            return (yield from Flow.of(pulses).parts)
        if len(header.channels) == 1 and wanted.a is None and wanted.b is None:
            _refuse_numbers(path, source, header)
        lines = choose_channels(path, header.channels, wanted, header.channels)
        times, pins, changes = Times(path, header), _Pins(path, header, options, lines), _Changes(header)
        apart = np.empty(0)
        for number, columns in blocks(path, source, header, block):
            if (part := changes.part(times.of(number, columns), pins.of(number, columns))) is not None:
                if not apart.size:
                    apart = np.diff(part.time[1:][np.diff(part.level & 3) != 0])
                    check_seconds(path, header, options.slowest_s, apart, "edges", whole=times.whole)
                yield part._replace(read=position(file.buffer))
        pins.check_end(source.ended)
        yield changes.end(path)
    return source_of(wanted, header.channels, lines, (*times.notes, *pins.notes, *changes.notes))


def _pulses(path: Path, source: Lines, header: Header, options: TextOptions, *, one_line: bool) -> Recording:
    """Return a recording in which each row of a text is a pulse of no width on line A."""
    if not one_line:
        raise OptionError("sensor", f"must be pulses for {path}: each of its rows is a pulse")
    assert header.time is not None
    times = Times(path, header, periods=options.pulse_periods is not None)
    parts = [np.empty(0)]
    for number, columns in blocks(path, source, header):
        parts.append(times.of(number, columns))
        check_edges(path, 2 * number[-1])
    time, name = np.concatenate(parts), header.names[header.time]
    check_rows(path, source, len(time))
    at = np.repeat(header.seconds(time - time[0]), 2)
    check_seconds(path, header, options.slowest_s, np.diff(at[::2]), "pulses", whole=times.whole)
    level = 1 - np.arange(len(at), dtype=np.uint8) % 2
    notes = (f"each of the {len(time)} rows is a pulse", *times.notes)
    lines = Source({"a": f"the rows' {name}", "b": ""}, float(at[-1]), len(at), notes=notes)
    return Recording(at, level, np.zeros_like(level), float(at[-1]), source=lines)


class _Pins:
    """Gives the levels of the lines, HELD before they are known."""

    def __init__(self, path: Path, header: Header, options: TextOptions, lines: Sequence[Line]) -> None:
        self._path, self._header, self._threshold = path, header, options.threshold
        self._lines = [(header.column(number), bit) for number, bit in lines]
        self._last = np.full(len(lines), cell_parsers.HELD, np.int8)
        self._gaps = 0

    def of(self, line: Sequence[int], columns: Sequence[Sequence[str]]) -> NDArray[np.int8]:
        """Return those of a block of rows, a row for each line."""
        every = []
        for (column, bit), last in zip(self._lines, self._last, strict=True):
            texts, name = columns[column], self._header.names[column]
            if bit is not None:
                level, rule = cell_parsers.bits(texts, bit), f"{name} must be a whole number"
            elif self._threshold is not None:
                level = cell_parsers.compared(texts, self._threshold, self._header.volts(column))
                rule = f"{name} must be a number"
            else:
                level, rule = cell_parsers.levels(texts), f"level of {name} must be 0 or 1"
            hint = _option_for(name, unit_in(self._header, column), texts)
            plain = bit is None and self._threshold is None
            refuse(self._path, line, level == cell_parsers.BAD, rule, texts, hint if plain else lambda _: "")
            self._gaps += texts.count("X") + texts.count("x")
            every.append(cell_parsers.held(level, int(last)))
        level = np.stack(every)
        self._last = level[:, -1]
        return level

    def check_end(self, ended: bool) -> None:
        """Check that nothing is missing at the end of the last line, where a part of a number is another one."""
        header, last = self._header, len(self._header.names) - 1
        numbers = {column for column, bit in self._lines if bit is not None or self._threshold is not None}
        if not ended and last in numbers | {header.time}:
            raise cut(self._path)

    @property
    def notes(self) -> list[str]:
        """Return what was made of the levels."""
        return [f"{plural(self._gaps, 'cell')} with an X: the level before holds there"] if self._gaps else []


def _refuse_numbers(path: Path, source: Lines, header: Header) -> None:
    """Refuse a text whose only channel is a counter, an angle or a speed in its first rows."""
    column, name = header.column(0), header.channels[0]
    rows = [split(line, header.table.separator) for line in source.head[header.table.start :]]
    texts = [row[column] for row in rows if column < len(row)]
    hint = _option_for(name, unit_in(header, column), texts)(next(iter(texts), ""))
    if hint and "[0]" not in hint and "--threshold" not in hint:
        raise CaptureError(f"{path} must have at least two logic channels, not {name} (0){hint}")


def _option_for(name: str, unit: str, texts: Sequence[str]) -> Callable[[str], str]:
    """Return a function of a bad cell of a column that names the option which reads the column."""
    value = cell_parsers.numbers(texts)
    whole = not np.any(value != np.rint(value), where=~np.isnan(value))
    counts = np.any(np.abs(value) > 3) or re.search(r"count|cnt|tick|pos|pulse", name, re.IGNORECASE)
    angles = not whole and re.search(r"angle|theta|phi|pos|deg|turn", name, re.IGNORECASE)

    def option(cell: str) -> str:
        if not cell_parsers.NUMBER.fullmatch(cell) and not cell_parsers.unit_of(cell):
            return ""
        if unit in ANGLES or angles:
            return f" (of an angle, --angle {shlex.quote(name if unit else f'{name}:deg')} takes it)"
        if unit:
            return f" (a speed is a motion: simulate --motion csv:FILE:{shlex.quote(name)})"
        if whole and counts:
            return f" (of a counter, --count {shlex.quote(name)} takes its counts)"
        if cell.isdigit():
            return f" (of both lines in one number, --a {name}[0] is the lowest bit)"
        return " (of a voltage, --threshold 1.65V says from where on it is high)"

    return option


class _Changes:
    """Gives the rows that change a line, from that on in which all levels are known."""

    def __init__(self, header: Header) -> None:
        self._header = header
        self._start = self._end = 0.0
        self._last, self._unknown = -1, 0

    def part(self, time: NDArray[np.float64], levels: NDArray[np.int8]) -> Part | None:
        """Return those of a block of rows; None if no levels are known."""
        known = (levels != cell_parsers.HELD).all(axis=0)
        self._unknown += int(np.count_nonzero(~known))
        if not known.any():
            return None
        time, level = time[known], packed([line[known].astype(np.uint8) for line in levels])
        if self._last < 0:
            self._start = float(time[0])
        changed = np.diff(level.astype(np.int16), prepend=np.int16(self._last)) != 0
        self._last, self._end = int(level[-1]), float(time[-1]) - self._start
        *seconds, until = self._header.seconds(np.append(time[changed] - self._start, self._end))
        return Part(np.array(seconds), level[changed], float(until))

    def end(self, path: Path) -> Part:
        """Return no further row, up to the end."""
        if self._last < 0:
            what = "in which all levels are known" if self._unknown else "after its header"
            raise CaptureError(f"{path} must have at least one row {what}, not 0")
        return Part(np.empty(0), np.empty(0, dtype=np.uint8), self._header.duration(self._end))

    @property
    def notes(self) -> list[str]:
        """Return what was left out."""
        left_out = f"{plural(self._unknown, 'row')} left out at the beginning, where not all levels are known"
        return [left_out] if self._unknown else []


def write_csv(path: str | os.PathLike[str], recording: Recording) -> None:
    """Write a recording as text with the header `time,a,b`, and `z` and `tick_in` if it has these lines.

    `read_csv`, given the names of these lines, returns the same changes and duration: times are the shortest decimals
    that read as the same float64. A last row without a change marks the end of the recording. The file takes its new
    content only when all is written; CaptureError if it cannot be.
    """
    columns: list[NDArray[np.generic]] = [recording.time + 0.0, *recording.lines.values()]  # no -0.0
    if recording.duration > recording.time[-1]:
        columns = [np.append(column, column[-1]) for column in columns]
        columns[0][-1] = recording.duration
    with writing(Path(path)) as beside:
        files.write_csv(beside, ("time", *recording.lines), files.rows_of(columns))
