"""A session watches a board, through unplugging and silence."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from tachometry.boards.host.demo import DemoBoard
from tachometry.boards.host.link import Counts, NoAnswer, Port
from tachometry.boards.host.snapshot import Snapshot
from tachometry.boards.monitor.serial_port import Unplugged

_PAUSE = 0.1  # seconds between two looks for a port that is not there
_SILENCE = 2.0  # seconds without telemetry, beyond those of a few frames
_FRAMES = 5
_FOREIGN = 8  # bytes that are no frames and no glitches of a line that is being plugged in either
_WRAP = 1 << 32  # clocks
_Answer = TypeVar("_Answer")


class ClosablePort(Port, Protocol):
    """Describes a port that can be given back."""

    def close(self) -> None:
        """Give it back."""


class ForeignDevice(ValueError):
    """A device sends at the port, but not as a tachometer."""


@dataclass(frozen=True)
class Frame:
    """Holds telemetry, and when it was captured."""

    time: float  # seconds of the board since the first frame. Over a reconnection they go on by the clock of the host.
    snapshot: Snapshot


def connected(name: str, port: Port, manifest: Mapping[str, Any], timeout: float = 0.5) -> DemoBoard:
    """Return the demo at a port.

    It raises WrongBoard if another board, or another configuration, answers, ForeignDevice if something comes that no
    tachometer sends, and NoAnswer if nothing answers.
    """
    try:
        return DemoBoard(port, manifest, timeout)
    except NoAnswer as error:
        if error.foreign >= _FOREIGN:
            text = f"{name} sends bytes that no tachometer sends: it must be another port, or another baud rate"
            raise ForeignDevice(text) from error
        raise NoAnswer(f"nothing answers at {name}") from error


class Session:
    """Gives the telemetry of a board.

    - `opened`: Opens the port; raises `Unplugged` where there is none for now.
    - `period`: Ticks from a frame of telemetry to the next.
    - `settings`: What the emulator is set to after each connection, see `DemoBoard.set`.
    """

    def __init__(
        self,
        name: str,
        opened: Callable[[], ClosablePort],
        manifest: Mapping[str, Any],
        period: int,
        settings: Mapping[str, int] | None = None,
        told: Callable[[str], None] | None = None,
        timeout: float = 0.5,
    ) -> None:
        self._name, self._opened, self._manifest = name, opened, manifest
        self._period, self._settings = period, dict(settings or {})
        self._told, self._timeout = told or (lambda text: None), timeout
        self._clock_hz: int = manifest["clock_hz"]
        self._silence = _SILENCE + _FRAMES * period * manifest["tick_cycles"] / self._clock_hz
        self._port: ClosablePort | None = None
        self._board: DemoBoard | None = None
        self._before = Counts()  # of connections that have ended
        self._clocks = 0  # since the first frame
        self._latest: int | None = None  # time of the latest frame of this connection
        self._heard = time.monotonic()  # when the latest frame came,
        self._patient_since = self._heard  # or the connection was made
        self.waits_for = ""  # why there is no telemetry; empty: there is
        self.connections = 0

    @property
    def counts(self) -> Counts:
        """The sum over all connections."""
        return self._before if self._board is None else _sum(self._before, self._board.link.receiver.counts)

    def poll(self) -> Sequence[Frame]:
        """Return telemetry that has come since the last call; connects, and waits for a short time if nothing is there.

        It raises what `connected` does, but waits for a board that does not answer, and OSError if the port cannot be
        used.
        """
        if self._board is None and not self._connect():
            time.sleep(_PAUSE)
            return []
        assert self._board is not None
        try:
            found = self._board.poll()
        except Unplugged as error:
            self._disconnect(error.why)
            return []
        now = time.monotonic()
        if not found and now - self._patient_since > self._silence:
            self._disconnect("it is silent")
        frames = [Frame(self._time(snapshot["time"], now), snapshot) for snapshot in found]
        if frames:
            self._heard = self._patient_since = now
        return frames

    def set(self, settings: Mapping[str, int]) -> None:
        """Change settings of the emulator, now and after each connection from now on."""
        self._settings |= settings
        self._asked(lambda board: board.set(**settings))

    def counters(self) -> dict[str, int]:
        """Return what the core has counted; empty if it cannot be asked now."""
        return self._asked(lambda board: board.client.counters()) or {}

    def _asked(self, ask: Callable[[DemoBoard], _Answer]) -> _Answer | None:
        """Return what the board answers; None if it cannot be asked now."""
        try:
            return None if self._board is None else ask(self._board)
        except NoAnswer:
            self._disconnect("nothing answers")
        except Unplugged as error:
            self._disconnect(error.why)
        return None

    def close(self) -> None:
        """End the telemetry, and give the port back."""
        if self._board is not None:
            with suppress(OSError):
                self._board.stream(0)
            self._disconnect("")

    def _connect(self) -> bool:
        try:
            self._port = self._opened()
            board = connected(self._name, self._port, self._manifest, self._timeout)
            if self._settings:
                board.set(**self._settings)
                board.client.clear()  # both lines of another source may differ, which is no error of the encoder
            board.stream(self._period)
        except Unplugged as error:
            self._wait(error.why)
        except NoAnswer:
            self._wait("nothing answers")
        except ForeignDevice:
            if not self.connections:
                self._give_back()
                raise
            self._wait("something else answers")
        except BaseException:
            self._give_back()
            raise
        else:
            self._board, self._latest = board, None
            self.connections += 1
            if self.connections == 1 or self.waits_for:
                self._told(f"connected to {self._name}")
            self.waits_for = ""
            self._patient_since = time.monotonic()
            return True
        self._give_back()
        return False

    def _disconnect(self, why: str) -> None:
        self._before, self._board = self.counts, None
        self._give_back()
        if why:
            self._wait(why)

    def _wait(self, why: str) -> None:
        if why != self.waits_for:
            self._told(f"waiting for {self._name}: {why}")
        self.waits_for = why

    def _give_back(self) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None

    def _time(self, clock: int, now: float) -> float:
        if self._latest is not None:
            self._clocks += (clock - self._latest) % _WRAP
        elif self.connections > 1:
            self._clocks += round((now - self._heard) * self._clock_hz)
        self._latest = clock
        return self._clocks / self._clock_hz


def _sum(one: Counts, other: Counts) -> Counts:
    return Counts(one.frames + other.frames, one.lost + other.lost, one.bytes_dropped + other.bytes_dropped)
