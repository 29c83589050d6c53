"""Encoder signals travel through the project as change lists, in seconds, then on the core's clock.

A `Recording` is what a virtual encoder or a logic analyser gives: the instants at which the lines change. `place`
puts it on a clock, as the first synchroniser flip-flop would see it; the `PinTrace` that results is what every engine
and every golden model takes. Both grow with the number of edges, never with the number of clocks. The index line Z and
the external tick may be absent from both; where they are there, a row may change them alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.memory import bytes_of, check_memory
from tachometry.sim.signals.source import Source
from tachometry.spec import TachometerSpec
from tachometry.spec.core.front_end import OF_CONTROLS
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END
from tachometry.spec.language.units import format_time

LINES = ("a", "b", "c", "z", "tick_in")

# What a computer's memory holds: an edge and a tick take some 300 bytes each on their way to a report.
MAX_EDGES = 10_000_000
MAX_TICKS = 10_000_000
MOST_IN_PIECES = 10**11  # ticks of a run of which some are held at once: it would take days


_QUADRATURE = np.array([0, 1, 3, 2], dtype=np.uint8)


def quadrature(quarter: NDArray[np.int64]) -> NDArray[np.uint8]:
    """Return a + 2 B in the quarters of a period, counted forwards from the one in which both are low."""
    return _QUADRATURE[quarter & 3]


def packed(lines: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Return a number for each row, with a bit for each line, the first lowest."""
    level = np.zeros(len(lines[0]), dtype=np.min_scalar_type((1 << len(lines)) - 1))
    for bit, line in enumerate(lines):
        level |= line.astype(level.dtype) << level.dtype.type(bit)
    return level


def merged(*clocks: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return all clocks of ordered lists, in order, each once; `np.union1d` hashes them, ten times as slowly."""
    every = np.sort(np.concatenate(clocks), kind="stable")
    return every[np.diff(every, prepend=every[:1] - 1) > 0]


class _Lines:
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    c: NDArray[np.uint8] | None
    z: NDArray[np.uint8] | None
    tick_in: NDArray[np.uint8] | None

    @property
    def lines(self) -> dict[str, NDArray[np.uint8]]:
        """The lines that are there, by name."""
        every = {name: getattr(self, name, None) for name in LINES}
        return {name: line for name, line in every.items() if line is not None} | getattr(self, "more", {})

    @property
    def wires(self) -> dict[str, NDArray[np.uint8]]:
        """Lines of the encoder with their complements, and inputs that move the position: each is one wire."""
        names = {*LINES, *(f"{line}_n" for line in LINES), *OF_CONTROLS}
        return {name: line for name, line in self.lines.items() if name in names}

    @property
    def level(self) -> NDArray[np.uint8]:
        """A number for each row, with a bit for each of `wires`, the first lowest."""
        return packed([*self.wires.values()])


def _split(level: NDArray[np.uint8], lines: Sequence[str]) -> dict[str, NDArray[np.uint8]]:
    return {name: level >> np.uint8(bit) & np.uint8(1) for bit, name in enumerate(lines)}


def _same_length(*columns: NDArray[np.generic]) -> bool:
    return len({len(column) for column in columns}) == 1


@dataclass(frozen=True)
class Recording(_Lines):
    """Holds the levels of the encoder lines over continuous time.

    - `time`, shape (n,), seconds, not decreasing, first entry 0: Instant from which the levels of the same row hold.
    - `a`, `b`, shape (n,), 0 or 1: Levels of the lines from `time` on. Row 0 is the level at rest before the first
      edge.
    - `duration`, seconds: Length of the recording; not before the last change.
    - `z`, `tick_in`, shape (n,), 0 or 1: Levels of the index line and of the external tick; None if it is absent.
    - `c`, shape (n,), 0 or 1: Levels of a third line, as of halls. A sensor of one line has 0 in `b`.
    - `source`: Of a capture, what it says of itself.
    - `more`, shape (n,): Further lines by name, such as `a_n`, the complement of A.
    """

    time: NDArray[np.float64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    duration: float
    z: NDArray[np.uint8] | None = None
    tick_in: NDArray[np.uint8] | None = None
    source: Source | None = None
    c: NDArray[np.uint8] | None = None
    more: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (len(self.time) and _same_length(self.time, *self.lines.values())):
            raise ValueError("a recording must have as many times as levels, and at least one row")
        if self.time[0] != 0 or np.any(np.diff(self.time) < 0):
            raise ValueError("times of a recording must begin at 0 and must not decrease")
        if self.duration < self.time[-1]:
            raise ValueError(f"duration must be at least {self.time[-1]} s, not {self.duration} s")

    @staticmethod
    def of_level(
        time: NDArray[np.float64], level: NDArray[np.uint8], duration: float, lines: Sequence[str] = ("a", "b")
    ) -> "Recording":
        """Return the recording with these lines whose `level` is given."""
        found: dict[str, Any] = _split(level, lines)
        more = {name: found.pop(name) for name in lines if name not in LINES}
        return Recording(time, duration=duration, source=None, **found, more=more)

    def place(self, clock_hz: int) -> "PinTrace":
        """Sample the lines at clock edge c = time c / clock_hz; a change between two edges is seen at the later one.

        A change within rounding of an edge, such as a decimal time on the clock's grid, is seen at that edge.

        It raises ValueError if there are too many clocks to be told apart.
        """
        clock = self.clock(clock_hz)
        n_clocks = int(np.floor(self.duration * clock_hz))
        last = np.append(clock[1:] != clock[:-1], True) & (
            clock < max(n_clocks, 1)
        )  # of changes in one clock, the last
        row = np.flatnonzero(last)
        levels = [line[row] for line in self.lines.values()]
        changed = np.append(True, np.any([line[1:] != line[:-1] for line in levels], axis=0))
        lines = {name: line[changed] for name, line in zip(self.lines, levels, strict=True)}
        return PinTrace.of_lines(clock[row[changed]], max(n_clocks, 1), lines)

    def clock(self, clock_hz: int) -> NDArray[np.int64]:
        """Return the clock edge at which each row is seen."""
        if self.duration * clock_hz >= 1 << 53:
            raise ValueError(f"a recording must last less than 2^53 clocks, not {self.duration:.6g} s")
        edges = self.time * clock_hz
        return np.ceil(edges - 2 * np.spacing(edges)).astype(np.int64)

    @property
    def _edges(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Rows in which a line other than the index changes, and how many of them do."""
        lines = [self.a, self.b] if self.c is None else [self.a, self.b, self.c]
        changes = np.count_nonzero(np.diff(np.stack(lines)), axis=0)
        row = np.flatnonzero(changes) + 1
        return row, changes[row - 1]

    def n_merged(self, clock_hz: int, n_clocks: int) -> int:
        """Return edges, but of Z, that come in the clock of an edge before them, within the first `n_clocks`."""
        row, _ = self._edges
        clock = self.clock(clock_hz)[row]
        return int(np.count_nonzero(np.diff(clock[clock < n_clocks]) == 0))

    @property
    def lasting(self) -> NDArray[np.float64]:
        """Seconds for which each number of `level` holds."""
        return np.bincount(self.level, np.diff(self.time, append=self.duration), 256).astype(np.float64)

    @property
    def n_changes(self) -> int:
        """Rows but the first."""
        return len(self.time) - 1

    @property
    def n_together(self) -> int:
        """Instants at which more than one of A, B and C changes."""
        return int(np.count_nonzero(self._edges[1] > 1))


@dataclass(frozen=True)
class PinTrace(_Lines):
    """Holds the levels that the first synchroniser flip-flop samples, on the core's clock.

    - `clock`, shape (n,), strictly increasing, first entry 0: Clock edge from which the levels of the same row are
      sampled (clock edge 0 is the first after reset).
    - `a`, `b`, shape (n,), 0 or 1
    - `z`, `tick_in`, shape (n,), 0 or 1: Index line and external tick; None if it is absent.
    - `more`, shape (n,): Further inputs by name, such as `preset`. `probe` and `probe_arm` have a bit for each probe,
      the first lowest; a setting, such as `probe_edges`, is what a program has written.
    """

    clock: NDArray[np.int64]
    a: NDArray[np.uint8]
    b: NDArray[np.uint8]
    n_clocks: int
    z: NDArray[np.uint8] | None = None
    tick_in: NDArray[np.uint8] | None = None
    c: NDArray[np.uint8] | None = None
    more: Mapping[str, NDArray[np.uint8]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (len(self.clock) and _same_length(self.clock, *self.lines.values())):
            raise ValueError("a pin trace must have as many clocks as levels, and at least one row")
        if self.clock[0] != 0 or np.any(np.diff(self.clock) <= 0):
            raise ValueError("clocks of a pin trace must begin at 0 and must increase")

    @classmethod
    def of(cls, recording: Recording, spec: TachometerSpec) -> "PinTrace":
        """Return what the pins of a core see of a recording: with nominal external ticks if the core takes them and
        there are none, and with probes that are always armed and a stream that is always ready.

        It raises ValueError if there are too many clocks to be told apart, more than `MAX_TICKS` ticks, or more than
        the memory that is free can hold.
        """
        check_ticks(recording.duration, spec)
        n_ticks = recording.duration / float(spec.timing.tick_seconds)
        check_memory(bytes_of(spec, n_ticks, len(recording.time)), "what is run", "shorten it, or take longer ticks")
        return recording.place(spec.timing.clock_hz).completed(spec)

    @classmethod
    def of_lines(cls, clock: NDArray[np.int64], n_clocks: int, lines: Mapping[str, NDArray[np.uint8]]) -> "PinTrace":
        """Return the trace with these lines, whatever their names."""
        known: dict[str, Any] = {name: line for name, line in lines.items() if name in LINES}
        return cls(clock, n_clocks=n_clocks, **known, more={name: lines[name] for name in lines if name not in LINES})

    def until(self, n_clocks: int) -> "PinTrace":
        """Return the first clocks of the trace."""
        return self.part(0, n_clocks)

    def part(self, begin: int, end: int) -> "PinTrace":
        """Return the trace from one clock to before another."""
        row = slice(int(np.searchsorted(self.clock, begin, side="right")) - 1, int(np.searchsorted(self.clock, end)))
        clock = np.maximum(self.clock[row] - begin, 0)
        return PinTrace.of_lines(clock, end - begin, {name: line[row] for name, line in self.lines.items()})

    def then(self, more: "PinTrace") -> "PinTrace":
        """Return this trace and another one behind it."""
        clock = np.append(self.clock, self.n_clocks + more.clock)
        lines = {name: np.append(line, more.lines[name]) for name, line in self.lines.items()}
        changed = np.append(True, np.any([line[1:] != line[:-1] for line in lines.values()], axis=0))
        lines = {name: line[changed] for name, line in lines.items()}
        return PinTrace.of_lines(clock[changed], self.n_clocks + more.n_clocks, lines)

    def at(self, clock: NDArray[np.int64]) -> dict[str, NDArray[np.uint8]]:
        """Return the levels of all lines in these clocks."""
        held = np.searchsorted(self.clock, clock, side="right") - 1
        return {name: line[held] for name, line in self.lines.items()}

    def line_at(self, name: str, clock: NDArray[np.int64], otherwise: int = 0) -> NDArray[np.int64]:
        """Return a line in each of these clocks: 0 before the first row, `otherwise` if nothing drives it."""
        if name not in self.lines:
            return np.full(len(clock), otherwise, dtype=np.int64)
        return np.append(0, self.lines[name].astype(np.int64))[np.searchsorted(self.clock, clock, side="right")]

    def high(self, name: str) -> NDArray[np.int64]:
        """Return the clocks in which a line is not 0."""
        lasts = np.diff(self.clock, append=self.n_clocks) * (self.line_at(name, self.clock) != 0)
        row = np.repeat(np.arange(len(lasts)), lasts)
        return self.clock[row] + np.arange(len(row)) - np.repeat(np.cumsum(lasts) - lasts, lasts)

    def with_pulses(self, name: str, rises: NDArray[np.int64], width: int = 1) -> "PinTrace":
        """Return the same trace with a line that is high for `width` clocks from each of the clocks `rises`.

        They increase by more than `width`; those from `n_clocks` on are left out. Of a line with several bits the name
        ends in the number of one, such as probe_1.
        """
        line, _, bit = name.partition("_") if name[-1].isdecimal() else (name, "", "0")
        rises = rises[rises < self.n_clocks]
        clock = merged(self.clock, rises, rises + width)
        clock = clock[(clock >= 0) & (clock < self.n_clocks)]
        lines = self.at(clock)
        ends = np.searchsorted(rises + width, clock, side="right")
        high = (np.searchsorted(rises, clock, side="right") > ends).astype(np.uint8) << np.uint8(bit)
        lines[line] = lines.get(line, np.uint8(0)) & ~np.uint8(1 << int(bit)) | high
        return PinTrace.of_lines(clock, self.n_clocks, lines)

    def with_tick_in(self, rises: NDArray[np.int64]) -> "PinTrace":
        """Return the same trace with an external tick that is high for one clock from each of the clocks `rises`."""
        return self.with_pulses("tick_in", rises)

    def completed(self, spec: TachometerSpec) -> "PinTrace":
        """Return the same trace with all inputs of a core: with nominal external ticks if it takes them, and all else
        that is missing low, but probes armed, a stream ready, and complements those of their lines.
        """
        if spec.external_tick and self.tick_in is None:
            cycles = spec.timing.tick_cycles  # in step with the reset of the core
            first = 2 * cycles - 1 if cycles <= TICK_IN_TO_WINDOW_END + 1 else cycles - 1
            rises = np.arange(first, self.n_clocks, cycles, dtype=np.int64) - TICK_IN_TO_WINDOW_END
            return self.with_tick_in(rises).completed(spec)
        low = {name: np.zeros_like(self.a) for name in spec.front_end.controls if name not in self.lines}
        low |= {pin.port.name: np.full_like(self.a, pin.rest) for pin in spec.front_end.pins if not pin.of}
        low |= {f"{line}_n": self.lines[line] ^ np.uint8(1) for line in spec.front_end.complemented}
        return PinTrace.of_lines(self.clock, self.n_clocks, low | self.lines) if low else self


def check_ticks(duration: float, spec: TachometerSpec, most: int = MAX_TICKS, of: str = "") -> None:
    """Check that so many seconds are not too many ticks to be held, `of` each axis; ValueError if they are."""
    ticks = duration / float(spec.timing.tick_seconds)
    if not ticks <= most:
        longest = format_time(most * spec.timing.tick_seconds)
        raise ValueError(
            f"what is run must have at most {most} ticks{of}, {longest} of this tick, not {ticks:.6g}: shorten it, or "
            "take longer ticks"
        )
