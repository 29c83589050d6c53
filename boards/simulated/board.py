"""A simulated board stands behind a pseudo-terminal, which any program opens as a serial port."""

import os
import select
import threading
import time
from contextlib import AbstractContextManager, suppress
from typing import Protocol

try:
    import pty
    import tty
except ImportError:  # Windows has none
    HAS_TERMINALS = False
else:
    HAS_TERMINALS = True

_STEP = 0.005  # seconds of board after which it is looked at again
_MOST = 0.1  # seconds that the simulation catches up, after it had no processor
_ROOM = 4096  # bytes that are taken from the host at once


class Simulation(Protocol):
    """Describes a board whose clocks pass on request, such as `sim.engines.board.BoardSimulation`."""

    def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
        """Let clocks pass while bytes come; what is sent, and what of the bytes is left."""


class SimulatedBoard(AbstractContextManager["SimulatedBoard"]):
    """Runs a simulation in a thread, in real time, or slower where the processor is; use as a context manager.

    Bytes that nobody reads are lost, as on a real line, once the pseudo-terminal holds no more. The serial port is
    `path`. Only this object may use the simulation until it is closed. It raises OSError if the system has no
    pseudo-terminals, or no more of them.
    """

    def __init__(self, simulation: Simulation, clock_hz: int) -> None:
        if not HAS_TERMINALS:
            raise OSError("a simulated board needs pseudo-terminals, which Linux and macOS have")
        self._simulation, self._clock_hz = simulation, clock_hz
        self._error: Exception | None = None
        self._board, self._terminal = pty.openpty()
        try:
            # Held open, so that it stays as it is while no host has it.
            tty.setraw(self._terminal)
            os.set_blocking(self._board, False)
            self.path = os.ttyname(self._terminal)
            self._wakes, self._wake = os.pipe()
        except BaseException:
            os.close(self._board)
            os.close(self._terminal)
            raise
        self._thread = threading.Thread(target=self._run, name=f"board at {self.path}", daemon=True)
        self._thread.start()

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Stop the thread, and close the port; what the simulation has raised is raised here."""
        if self._wake < 0:
            return
        os.close(self._wake)  # its other end becomes readable
        self._wake = -1
        self._thread.join()
        os.close(self._wakes)
        os.close(self._terminal)
        if self._error is not None:
            raise self._error

    def _run(self) -> None:
        try:
            self._serve()
        except Exception as error:
            self._error = error
        finally:
            os.close(self._board)  # a host reads the end of the file

    def _serve(self) -> None:
        left = b""
        done = time.monotonic()  # up to when the clocks have passed
        while True:
            patience = max(done + _STEP - time.monotonic(), 0.0)
            ready, _, _ = select.select([self._wakes, *([] if left else [self._board])], [], [], patience)
            if self._wakes in ready:
                return
            if self._board in ready:
                left = self._read()
            now = time.monotonic()
            done = max(done, now - _MOST)
            n_clocks = max(int(min(now - done, _STEP) * self._clock_hz), 1)
            done += n_clocks / self._clock_hz
            sent, left = self._simulation.run(n_clocks, left)
            if sent:
                self._write(sent)

    def _read(self) -> bytes:
        try:
            return os.read(self._board, _ROOM)
        except BlockingIOError:
            return b""

    def _write(self, data: bytes) -> None:
        with suppress(BlockingIOError):  # nobody reads
            os.write(self._board, data)
