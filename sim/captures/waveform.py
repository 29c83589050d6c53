"""Variables of a waveform, whatever file it is in, become the lines of a recording."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tachometry.sim.captures.file import CaptureError, Channels, choose_channels, source_of
from tachometry.sim.signals.flow import ROWS, Part, Parts
from tachometry.spec.language.units import plural

Code = bytes | int  # what a file calls a variable
_MOST_NAMED = 1 << 25  # characters of the names of all variables
_MOST_KNOWN = 1 << 12  # values whose rows are kept
_EACH = 64  # more, for each: what else is kept of it
_LEVELS = {"0": 0, "1": 1, "l": 0, "h": 1}
_ALLOWED = "".join(_LEVELS) + "xzuw-"  # what VHDL and Verilog have beside levels: the one before holds


class Variable(NamedTuple):
    """Describes a variable of a waveform."""

    name: str  # with its scopes, as `tb.core.a`
    size: int  # number of its bits
    code: Code  # several may share one
    # high and low: numbers of its first and last bit, as declared: 3 and 0, or 1 and 4
    high: int
    low: int

    def position(self, path: Path, bit: int | None) -> int:
        """Return where a bit is, from the last one on; CaptureError if there is none of this number."""
        if bit is None:
            return 0
        if not min(self.high, self.low) <= bit <= max(self.high, self.low):
            raise CaptureError(f"bits of {self.name} of {path} must be from {self.high} to {self.low}, not {bit}")
        return abs(bit - self.low)


class Names:
    """Counts what a head of a waveform takes in memory."""

    def __init__(self, path: Path) -> None:
        self._path, self._left = path, _MOST_NAMED

    def add(self, *names: str | bytes) -> None:
        """Count a variable; CaptureError if there are too many."""
        self._left -= _EACH + sum(map(len, names))
        if self._left < 0:
            raise CaptureError(
                f"{self._path} must have names of variables of at most {_MOST_NAMED} characters, each with {_EACH} "
                "more: dump only the scope of the encoder"
            )


class Changes:
    """Parts of a recording in the making, from changes of variables; `unit` is how many seconds one of their times is.

    It begins when all lines have first been 0 or 1. What is neither, later on, is as before. Lines are given as to
    `choose_channels`; numbers count the variables of one bit, and what is
    declared twice is one of them.
    """

    def __init__(self, path: Path, variables: Sequence[Variable], wanted: Channels, unit: Fraction) -> None:
        self._path, self._wanted, self._unit = path, wanted, unit
        self.position: Callable[[], int] = int  # gives the bytes of the file that have been read
        ordered = sorted(dict.fromkeys(variables), key=lambda variable: variable.size > 1)
        self._names = {number: variable.name for number, variable in enumerate(ordered)}
        scalars = {number: self._names[number] for number, variable in enumerate(ordered) if variable.size == 1}
        vectors = {number: name for number, name in self._names.items() if number not in scalars}
        self._chosen = choose_channels(path, scalars, _default(scalars, wanted), vectors)
        of = [(ordered[line.number], line.bit) for line in self._chosen]
        self._sources = [(variable, variable.position(path, bit)) for variable, bit in of]
        self._value = {variable.code: "x" for variable, _ in of}
        # the row that follows from values that have been, if all lines are known then, and `_last` and `_gap` with it
        self._known = dict[tuple[str, ...], tuple[int, list[int | None], list[bool]]]()
        self._last: list[int | None] = [None] * len(of)
        self._gap, self._gaps = [False] * len(of), 0
        self._times = list[int | Fraction]()
        self._rows = bytearray()
        self._row: int | None = None  # the last one
        self._first: int | Fraction = 0
        self._begin: int | Fraction | None = None
        self._now: int | Fraction = 0
        self._changed = False

    @property
    def codes(self) -> frozenset[Code]:
        """Those of the variables that lines are taken from."""
        return frozenset(self._value)

    def at(self, time: int | Fraction) -> Iterator[Part]:
        """Go on to a time, and give the rows before, if they are many; CaptureError if it is before the last one."""
        self._settle()
        if self._begin is None:
            self._begin = time
        elif time < self._now:
            raise CaptureError(f"times of {self._path} must not decrease, as from {self._now} to {time}")
        self._now = time
        if len(self._rows) >= ROWS:
            yield self._part()

    def change(self, code: Code, value: str) -> None:
        """Give a variable another value, its first bit first."""
        self._value[code] = value.lower()
        self._changed = True

    def _settle(self) -> None:
        """End what happens at one time."""
        if not self._changed:
            return
        self._changed = False
        values = tuple(self._value.values())
        if values in self._known:
            row, self._last, self._gap = self._known[values]
        else:
            row = self._row_of([self._level(variable, position) for variable, position in self._sources])
            if True not in self._gap and len(self._known) < _MOST_KNOWN:
                self._known[values] = row, self._last, self._gap
        if None not in self._last and row != self._row:
            self._first = self._now if self._row is None else self._first
            self._row = row
            self._times.append(self._now)
            self._rows.append(row)

    def _row_of(self, levels: Sequence[int | None]) -> int:
        """Return levels with a bit for each line, and note those that are not known."""
        gap = [level is None for level in levels]
        self._gaps += sum(
            now and not was and last is not None for now, was, last in zip(gap, self._gap, self._last, strict=True)
        )
        self._gap = gap
        self._last = [last if level is None else level for level, last in zip(levels, self._last, strict=True)]
        return sum(level << line for line, level in enumerate(self._last) if level is not None)

    def _level(self, variable: Variable, position: int) -> int | None:
        """Return the level of a line; None if there is none."""
        text = self._value[variable.code]
        value = text.lstrip("0") or text[-1:]
        if len(value) > variable.size or not value or value.strip(_ALLOWED):
            shown = text if len(text) <= 40 else text[:40] + "..."
            raise CaptureError(
                f"{variable.name} of {self._path} must be {plural(variable.size, 'bit')} of 0, 1, x or z, not "
                f"{shown!r} at time {self._now}"
            )
        # What is shorter goes on with its first bit if that is no level, else with 0.
        first = "0" if value[0] in _LEVELS else value[0]
        return _LEVELS.get(value[-1 - position] if position < len(value) else first)

    def end(self, notes: Sequence[str] = ()) -> Parts:
        """Give the last rows, up to the last time."""
        self._settle()
        if self._row is None:
            raise CaptureError(f"{self._path} must contain the levels of all lines, 0 or 1, at least once")
        yield self._part()
        told = list(notes)
        if self._first > (self._begin or 0):
            at = float(self._first * self._unit.numerator / self._unit.denominator)
            told.append(f"begins at {at:.9g} s of the waveform, where all lines have been 0 or 1")
        if self._gaps:
            told.append(f"{plural(self._gaps, 'change')} to x or z: the level before holds there")
        return source_of(self._wanted, self._names, self._chosen, told)

    def _part(self) -> Part:
        first, unit = self._first, self._unit
        *seconds, until = (
            float((time - first) * unit.numerator / unit.denominator) for time in (*self._times, self._now)
        )
        part = Part(np.array(seconds), np.frombuffer(self._rows, dtype=np.uint8), until, self.position())
        self._times, self._rows = [], bytearray()
        return part


def _default(names: Mapping[int, str], wanted: Channels) -> Channels:
    """Return channels with A and B by the last parts of their names where these are unique, if not given."""

    def only(line: str) -> int | None:
        alike = [number for number, name in names.items() if name.rpartition(".")[2].casefold() == line]
        return alike[0] if len(alike) == 1 else None

    a, b = only("a"), only("b")
    if a is None or b is None:
        return wanted
    return replace(wanted, a=a if wanted.a is None else wanted.a, b=b if wanted.b is None else wanted.b)
