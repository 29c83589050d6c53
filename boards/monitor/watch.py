"""A board is watched: what has come of its telemetry is shown and recorded."""

import threading
import time
from collections import Counter, deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Protocol, Self

from tachometry.boards.host.link import Counts
from tachometry.boards.monitor.columns import Column, Value
from tachometry.boards.monitor.session import Frame, Session
from tachometry.spec import TachometerSpec
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.language.port import MISSED, WIDE

HISTORY = 10.0  # seconds that are kept
_COUNTERS = 0.5  # seconds from a look at the counters to the next
_PATIENCE = 5.0  # seconds without telemetry after which a duration can be over


@dataclass
class State:
    """Holds the state of a board."""

    title: str
    spec: TachometerSpec
    columns: Mapping[str, Column]
    counts: Counts = field(default_factory=Counts)
    counters: Mapping[str, int] = field(default_factory=dict)
    told: Counter[str] = field(default_factory=Counter)  # in how many frames each flag of a wrong index was set
    waits_for: str = ""  # why there is no telemetry; empty: there is
    recorded: str = ""
    frame: Frame | None = None
    history: deque[tuple[float, float, Value, Value]] = field(default_factory=deque)

    def take(self, frames: Iterable[Frame]) -> None:
        """Frames that have come."""
        for frame in frames:
            self.frame = frame
            self.told.update(name for name in (WIDE, MISSED) if frame.snapshot.flags.get(name))
            lower, upper = (self.value(name) for name in BOUNDS)
            speed = self.value("velocity")
            assert speed is not None
            self.history.append((frame.time, speed, lower, upper))
        while self.history and self.history[-1][0] - self.history[0][0] > HISTORY:
            self.history.popleft()

    def value(self, name: str) -> Value:
        """Return a value of the latest frame, None if there is none."""
        return self.columns[name].value(self.frame.snapshot) if self.frame and name in self.columns else None


class Sink(Protocol):
    """Takes telemetry: a recording, or what publishes it."""

    def write(self, frame: Frame) -> None:
        """Take a frame."""

    def waits(self, why: str) -> None:
        """Take why there is no telemetry; empty: there is."""


class Display(Protocol):
    """Where a state is shown; a context manager."""

    def __enter__(self) -> Self: ...

    def __exit__(self, *_: object) -> None: ...

    def notice(self, text: str) -> None:
        """Show that something has changed."""

    def show(self, state: State) -> None:
        """Show the state, if it is time to."""

    def end(self, state: State) -> None:
        """Show the state for the last time."""


def watch(
    session: Session,
    state: State,
    screen: Display,
    sinks: Sequence[Sink],
    seconds: Fraction | None,
    stop: threading.Event,
) -> None:
    """Show telemetry, and hand it to sinks, until it is stopped, or for so many seconds of the board.

    It raises TimeoutError if none has come in this time.
    """
    heard = looked = time.monotonic()
    over = False
    try:
        while not (over or stop.is_set()):
            frames = list(session.poll())
            now = time.monotonic()
            if frames:
                heard = now
            elif seconds is not None and now - heard > max(float(seconds), _PATIENCE):
                if state.frame is None:
                    raise TimeoutError(f"no telemetry has come in {now - heard:.0f} s: {session.waits_for}")
                over = True
            if seconds is not None and frames and frames[-1].time > seconds:
                frames = [frame for frame in frames if frame.time <= seconds]
                over = True
            _hand_over(sinks, frames, session)
            if over or not state.counters or now - looked >= _COUNTERS:
                looked = now
                state.counters = session.counters() or state.counters
            state.take(frames)
            state.counts, state.waits_for = session.counts, session.waits_for
            screen.show(state)
    finally:
        session.close()
    screen.end(state)


def _hand_over(sinks: Sequence[Sink], frames: Sequence[Frame], session: Session) -> None:
    for sink in sinks:
        for frame in frames:
            sink.write(frame)
        if session.connections:
            sink.waits(session.waits_for)
