"""A recording that comes in parts, as a motion makes it or a file is read, and of which one part is held at a time."""

from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.recording import MOST_IN_PIECES, PinTrace, Recording, check_ticks
from tachometry.sim.signals.source import Source
from tachometry.spec import TachometerSpec

ROWS = 1 << 16  # of a part


class Part(NamedTuple):
    """Holds the next rows of a recording, which may be none."""

    time: NDArray[np.float64]  # shape (n,), seconds: the first row of all is at 0
    level: NDArray[np.uint8]  # shape (n,): a bit for each line, the first lowest
    until: float  # seconds: no later row is before it; of the last part, the duration
    read: int = 0  # bytes of a file up to here, if they are known


Parts = Generator[Part, None, Source | None]


@dataclass
class Flow:
    """Gives a recording in parts, once: all together, or as pieces of what the pins see.

    What it says of itself is, before its end, of the parts that have come.
    """

    wires: tuple[str, ...]  # as of `Recording`, by name
    parts: Parts  # returns the source, if it is a capture, without what is counted here
    check: Callable[[int], object] = lambda _: None  # raises ValueError if so many rows are too many to be held
    duration: float | None = None  # seconds, if it is known
    source: Source | None = None  # known at the end, if it is that of a capture
    told: Callable[[Source], Source] = lambda source: source  # adds to it what is to be found elsewhere
    tail_s: float = 0.0  # seconds that the levels hold after the last row, if the recording ends with that
    size: int = 0  # bytes of the file, if it is one
    read: int = 0  # of them
    # as of `Recording`
    n_changes: int = -1
    n_together: int = 0
    lasting: NDArray[np.float64] = field(default_factory=lambda: np.zeros(256))
    _n_merged: int = 0
    _held: Recording | None = None  # rows of the piece that has come last, and of later ones

    @classmethod
    def of(cls, recording: Recording) -> "Flow":
        """Return the flow of a recording that is there as a whole."""

        def parts() -> Parts:
            time, level = recording.time, recording.level
            for begin in range(0, len(time), ROWS):
                until = time[begin + ROWS] if begin + ROWS < len(time) else recording.duration
                yield Part(time[begin : begin + ROWS], level[begin : begin + ROWS], float(until))
            return recording.source

        return cls((*recording.wires,), parts(), duration=recording.duration)

    def whole(self) -> Recording:
        """Return the recording; ValueError if it has too many changes."""
        self.check(0)
        held = list[Part]()
        for part in self._counted():
            held.append(part)
            self.check(self.n_changes + 1)
        time, level = np.concatenate([part.time for part in held]), np.concatenate([part.level for part in held])
        return replace(Recording.of_level(time, level, held[-1].until, self.wires), source=self.source)

    def moves(self) -> bool:
        """Return whether a line changes."""
        return any(self.n_changes for _ in self._counted())

    def pieces(self, spec: TachometerSpec, size: int) -> Iterator[PinTrace]:
        """Yield what the pins of a core see, at most `size` clocks at a time, which are a tick or more.

        A piece ends before an update of a tick, so that all that the update brings is in one piece.
        It raises ValueError for more than `MOST_IN_PIECES` ticks, or if clocks are too many to be told apart.
        """

        def cut(clock: int) -> int:
            update = spec.latency.tick + spec.latency.tick_to_velocity - 1
            return clock - (clock - update) % spec.timing.tick_cycles

        clock_hz, begin, held = spec.timing.clock_hz, 0, Part(np.empty(0), np.empty(0, dtype=np.uint8), 0.0)
        for time, level, until, read in self._counted():
            self.read = max(self.read, read)
            check_ticks(until, spec, MOST_IN_PIECES)
            held = Part(np.append(held.time, time), np.append(held.level, level), until)
            n_clocks = int(until * clock_hz)
            n_clocks = max(n_clocks, 1) if until == self.duration else cut(n_clocks)
            while begin < n_clocks:
                self._n_merged = self.n_merged(clock_hz, begin)
                end = cut(begin + size) if begin + size < n_clocks else n_clocks
                self._held = Recording.of_level(held.time, held.level, until, self.wires)
                yield self._held.place(clock_hz).completed(spec).part(begin, end)
                first = int(np.searchsorted(self._held.clock(clock_hz), end)) - 1
                held = Part(np.append(0.0, held.time[first + 1 :]), held.level[first:], until)
                begin = end

    def n_merged(self, clock_hz: int, n_clocks: int) -> int:
        """Return as `Recording.n_merged`, of pieces up to the one that has come last, in which clock `n_clocks` is."""
        return self._n_merged + (self._held.n_merged(clock_hz, n_clocks) if self._held else 0)

    def _counted(self) -> Iterator[Part]:
        """Yield the parts, and count what is in them; duration and source are known with the last one."""
        part: Part | None = next(self.parts)
        last, at, moved = np.empty(0, dtype=np.uint8), np.empty(0), 0
        while part is not None:
            level, times = np.append(last, part.level), np.append(at, part.time)
            self.lasting += np.bincount(level[:-1], np.diff(times), 256)
            self.n_changes += len(part.time)
            self.n_together += Recording.of_level(np.zeros(len(level)), level, 0.0, self.wires).n_together
            moved |= int(np.bitwise_or.reduce(level[1:] ^ level[:-1]))
            try:
                following = next(self.parts)
            except StopIteration as end:
                following, source = None, end.value
                if source is not None and source.n_changes < 0:
                    still = tuple(line for bit, line in enumerate(self.wires) if not moved >> bit & 1)
                    source = replace(source, duration=part.until, n_changes=self.n_changes, still=still)
                self.source = source and self.told(source)
                part = part._replace(until=part.until + self.tail_s * (part.until <= times[-1]))
                self.duration = part.until
                self.lasting[level[-1]] += part.until - times[-1]
            yield part
            part, last, at = following, level[-1:], times[-1:]
