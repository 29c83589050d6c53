"""A board that is unplugged, silent, or another one."""

import time
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import pytest
from support.demo import CLOCK_HZ, ToldBoard, demo_map, manifest_of

from tachometry.boards.host.client import WrongBoard
from tachometry.boards.monitor import session
from tachometry.boards.monitor.serial_port import Unplugged
from tachometry.boards.monitor.session import ForeignDevice, Frame

STEP = 24_000  # clocks of a look at the port: 2 ms
PERIOD = 50  # ticks of 20 us
TIMEOUT = 0.02


class Cable:
    """Ports to a board that can be unplugged."""

    def __init__(self, board: ToldBoard) -> None:
        self.board, self.plugged, self.opened, self.closed = board, True, 0, 0

    def open(self) -> "CablePort":
        if not self.plugged:
            raise Unplugged("cable", "it is out")
        self.opened += 1
        return CablePort(self)


class CablePort:
    def __init__(self, cable: Cable) -> None:
        self._cable, self._sent = cable, b""

    def write(self, data: bytes, /) -> None:
        self._check()
        self._sent += data

    def read(self, size: int = 1, /) -> bytes:
        self._check()
        found, self._sent = self._cable.board.run(STEP, self._sent)
        return found

    def close(self) -> None:
        self._cable.closed += 1

    def _check(self) -> None:
        if not self._cable.plugged:
            raise Unplugged("cable", "it is out")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session, "_PAUSE", 0.0)
    monkeypatch.setattr(session, "_SILENCE", 0.0)


def session_of(cable: Cable, told: list[str] | None = None, **more: Any) -> session.Session:
    manifest = manifest_of(demo_map())
    heard = (lambda text: None) if told is None else told.append
    return session.Session("cable", cable.open, manifest, PERIOD, told=heard, timeout=TIMEOUT, **more)


def until(watched: session.Session, fine: Callable[[list[Frame]], bool]) -> list[Frame]:
    """Return frames up to what is waited for; a board that never does it fails the test."""
    found: list[Frame] = []
    end = time.monotonic() + 60
    while time.monotonic() < end:
        found += watched.poll()
        if fine(found):
            return found
    raise AssertionError("it did not come")


def test_frames_and_their_times() -> None:
    """Every frame comes with its time, and settings are set before."""
    board = ToldBoard(demo_map())
    board.shown = {"VELOCITY": 0xFFFF_FFFF, "POSITION": 5}
    cable = Cable(board)
    watched = session_of(cable, settings={"speed": -5, "emulated": 1})
    frames = until(watched, lambda found: len(found) > 20)
    gaps = {round((two.time - one.time) * CLOCK_HZ) for one, two in pairwise(frames)}
    assert gaps == {PERIOD * 240}
    assert frames[0].time == 0.0
    assert {(frame.snapshot["velocity"], frame.snapshot["position"]) for frame in frames} == {(-1, 5)}
    assert (board.word("SPEED"), board.word("DEMO")) == ((1 << 32) - 5, 1)
    assert (watched.counts.frames, watched.counts.lost, watched.counts.bytes_dropped) == (len(frames), 0, 0)
    watched.close()
    assert board.word("TELEMETRY") == 0
    assert cable.opened == cable.closed == 1


@pytest.mark.usefixtures("quick")
def test_an_unplugged_board_is_waited_for() -> None:
    """It goes on when the cable is in again, with the same settings; the time goes on, too."""
    board, told = ToldBoard(demo_map()), list[str]()
    cable = Cable(board)
    cable.plugged = False
    watched = session_of(cable, told, settings={"speed": 7})
    assert [watched.poll() for _ in range(3)] == [[], [], []]
    assert told == ["waiting for cable: it is out"]
    cable.plugged = True
    before = until(watched, lambda found: len(found) > 5)
    cable.plugged = False
    assert not watched.poll()
    assert not watched.counters()
    assert watched.waits_for == "it is out"
    board.words = [register.reset for register in demo_map()]  # it had no power
    board.n_clocks = board._next = 0
    cable.plugged = True
    after = until(watched, lambda found: len(found) > 5)
    connected = "connected to cable"
    assert told == ["waiting for cable: it is out", connected, "waiting for cable: it is out", connected]
    assert before[-1].time < after[0].time < before[-1].time + 300  # less than the time that wraps
    assert board.word("SPEED") == 7
    assert watched.connections == 2
    assert not watched.waits_for
    assert watched.counts.frames == len(before) + len(after)
    assert watched.counts.lost == 0
    watched.close()
    assert cable.opened == cable.closed


@pytest.mark.usefixtures("quick")
def test_a_silent_board_is_waited_for() -> None:
    board, told = ToldBoard(demo_map()), list[str]()
    watched = session_of(Cable(board), told)
    board.silent = True
    assert not watched.poll()
    board.silent = False
    until(watched, lambda found: len(found) > 3)
    board.silent = True
    until(watched, lambda found: bool(watched.waits_for))
    board.silent = False
    until(watched, lambda found: len(found) > 3)
    silent = {"waiting for cable: nothing answers", "waiting for cable: it is silent"}
    assert told[0] == "waiting for cable: nothing answers"
    assert told[1] == told[-1] == "connected to cable"
    assert set(told[2:-1]) <= silent
    assert len(told) >= 4
    watched.close()


@pytest.mark.usefixtures("quick")
def test_settings_that_change_hold_after_a_reconnection() -> None:
    board = ToldBoard(demo_map())
    cable = Cable(board)
    watched = session_of(cable, settings={"speed": 7, "drop": 1})
    until(watched, lambda found: len(found) > 3)
    watched.set({"speed": 8})
    assert (board.word("SPEED"), board.word("NOISE")) == (8, 1 << 16)
    cable.plugged = False
    watched.set({"speed": 9})
    assert watched.waits_for == "it is out"
    cable.plugged = True
    until(watched, lambda found: len(found) > 3)
    assert (board.word("SPEED"), board.word("NOISE")) == (9, 1 << 16)
    watched.close()


@pytest.mark.parametrize("noise", [b"Hello, world!\r\n", b"\xa5" * 40, bytes(range(128, 256))])
def test_what_speaks_otherwise_is_refused(noise: bytes) -> None:
    board = ToldBoard(demo_map())
    board.noise = noise
    cable = Cable(board)
    watched = session_of(cable)
    told = "^cable sends bytes that no tachometer sends: it must be another port, or another baud rate$"
    with pytest.raises(ForeignDevice, match=told):
        watched.poll()
    assert cable.opened == cable.closed == 1


@pytest.mark.usefixtures("quick")
def test_noise_on_a_line_that_was_fine_is_waited_for() -> None:
    board, told = ToldBoard(demo_map()), list[str]()
    watched = session_of(Cable(board), told)
    until(watched, lambda found: len(found) > 3)
    board.noise = b"?!" * 20
    until(watched, lambda found: "waiting for cable: something else answers" in told)
    board.noise = b""
    until(watched, lambda found: len(found) > 3)
    assert watched.counts.bytes_dropped > 0
    watched.close()


def test_another_board_and_another_configuration_are_refused() -> None:
    cable = Cable(ToldBoard(demo_map("m", age="yes")))
    with pytest.raises(
        WrongBoard, match=r"^the board has configuration 0x[0-9a-f]{8}, the manifest of tachometer says"
    ):
        session_of(cable).poll()
    assert cable.opened == cable.closed == 1
    other = ToldBoard(demo_map())
    other.words[0] = 0
    with pytest.raises(WrongBoard, match=r"^the board must answer with 0x54414348, as a tachometer does, not 0x0+$"):
        session_of(Cable(other)).poll()
