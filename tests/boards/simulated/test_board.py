"""A simulated board behind its pseudo-terminal."""

import os
import threading
import time

import pytest
from support.demo import CLOCK_HZ, compiled, demo_map, manifest_of
from support.nightly import only

from tachometry.boards.host.demo import DemoBoard
from tachometry.boards.monitor.serial_port import SerialPort, Unplugged
from tachometry.boards.simulated.board import SimulatedBoard

BAUD = 1_000_000


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd")) if os.path.exists("/proc/self/fd") else 0


class Echo:
    """Sends what it is sent, a few bytes at a time."""

    def __init__(self) -> None:
        self.n_clocks = 0

    def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
        self.n_clocks += n_clocks
        return data[:7], data[7:]


def test_bytes_go_both_ways_as_they_are() -> None:
    sent, found = bytes(range(256)) * 8, b""
    with SimulatedBoard(Echo(), CLOCK_HZ) as board, SerialPort(board.path, BAUD) as port:
        port.write(sent)
        end = time.monotonic() + 60
        while len(found) < len(sent) and time.monotonic() < end:
            found += port.read(4096)
    assert found == sent


def test_it_is_not_faster_than_real_time() -> None:
    echo = Echo()
    began = time.monotonic()
    with SimulatedBoard(echo, CLOCK_HZ) as board, SerialPort(board.path, BAUD) as port:
        for _ in range(20):
            port.write(b"x")
            while not port.read():
                pass
    assert 0 < echo.n_clocks <= (time.monotonic() - began) * CLOCK_HZ + 100 * 20


# A hundred would show what each leaves; a thousand what runs out.
@pytest.mark.parametrize("number", only([100], [100, 1000]))
def test_connections_leave_nothing_behind(number: int) -> None:
    """To a board that stays, and to boards that come and go."""
    manifest = manifest_of(demo_map())
    simulation = compiled()
    threads, open_files = threading.active_count(), descriptors()
    with SimulatedBoard(simulation, CLOCK_HZ) as board:
        for _ in range(number // 10):
            with SerialPort(board.path, BAUD) as port:
                DemoBoard(port, manifest)
    paths = set()
    for _ in range(number):
        with SimulatedBoard(simulation, CLOCK_HZ) as board, SerialPort(board.path, BAUD) as port:
            paths.add(board.path)
            DemoBoard(port, manifest)
    assert (threading.active_count(), descriptors()) == (threads, open_files)
    assert len(paths) < number // 10  # names are used again, since none stays
    assert simulation.n_broken == 0


def test_bytes_that_nobody_reads_are_lost() -> None:
    class Loud:
        n_bytes = 0
        enough = threading.Event()

        def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
            self.n_bytes += 1 << 16
            if self.n_bytes > 1 << 20:
                self.enough.set()
            return bytes(1 << 16), b""

    loud = Loud()
    with SimulatedBoard(loud, CLOCK_HZ):
        assert loud.enough.wait(60)


def test_a_board_that_ends_is_unplugged() -> None:
    board = SimulatedBoard(Echo(), CLOCK_HZ)
    with SerialPort(board.path, BAUD) as port:
        board.close()
        board.close()
        with pytest.raises(Unplugged, match=f"^{board.path}: "):
            port.write(b"x")
    with pytest.raises(Unplugged, match=f"^{board.path}: No such file or directory$"):
        SerialPort(board.path, BAUD)


def test_what_the_simulation_raises_is_seen() -> None:
    class Broken:
        begun = threading.Event()

        def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
            self.begun.set()
            raise ZeroDivisionError("broken")

    board = SimulatedBoard(Broken(), CLOCK_HZ)
    assert Broken.begun.wait(60)
    with pytest.raises(ZeroDivisionError, match=r"^broken$"):
        board.close()


def test_ports_that_cannot_be_used() -> None:
    with pytest.raises(OSError, match=r"^/dev/null: Inappropriate ioctl for device$"):
        SerialPort("/dev/null", BAUD)
    with (
        SimulatedBoard(Echo(), CLOCK_HZ) as board,
        SerialPort(board.path, BAUD),
        pytest.raises(OSError, match=f"^{board.path} is used by another program$"),
    ):
        SerialPort(board.path, BAUD)
