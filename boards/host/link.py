"""Frames go over a UART: requests and their answers, and telemetry between them."""

import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from tachometry.boards.host.registers import HostRegisters
from tachometry.spec.registers import frames

_WORD_BYTES = 4


class Port(Protocol):
    """Describes a serial port, such as those of pyserial."""

    def read(self, size: int = 1, /) -> bytes:
        """Return at most so many bytes: what is there, or what comes within the port's own time limit."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""


class NoAnswer(TimeoutError):
    """Nothing that answers a request came in time.

    - `foreign`: Bytes that came instead and belong to no frame.
    """

    def __init__(self, text: str, foreign: int = 0) -> None:
        super().__init__(text)
        self.foreign = foreign


@dataclass
class Counts:
    """Counts what a receiver has seen."""

    frames: int = 0  # frames of telemetry that were right
    lost: int = 0  # frames of telemetry that the core has sent or left out, and that were not seen
    bytes_dropped: int = 0  # bytes that belong to no frame


@dataclass
class Receiver:
    """Finds frames in what comes over a line, however damaged it is.

    A frame is taken if its check is right and its words can be those of the registers. At a byte with which none
    begins, the search goes on with the next.
    """

    registers: HostRegisters
    request: bytes = b""  # what is to be answered; empty: nothing is
    # clocks from a frame of telemetry to the next, with which losses of 16 frames and more are seen; 0: not known
    frame_clocks: int = 0
    counts: Counts = field(default_factory=Counts)

    def __post_init__(self) -> None:
        self._bytes = bytearray()
        self._last: tuple[int, int] | None = None  # sequence and time of the latest telemetry
        names = [register["name"] for register in self.registers.captured]
        self._time = names.index("TIME") if "TIME" in names else None
        self._length = frames.telemetry_length(len(self.registers.captured))
        self.telemetry: deque[tuple[int, ...]] = deque()
        self.answer: frames.Answer | None = None

    def feed(self, data: bytes) -> None:
        """Take bytes; `telemetry` and `answer` have what was found in them.

        What stands behind an answer is left for the next call: it may be of other telemetry than what was before.
        """
        self._bytes += data
        asked, at = self.request, 0
        while at < len(self._bytes) and self.request == asked:
            size = self._frame(at)
            if size == 0:
                break
            at += size
        del self._bytes[:at]

    def reset(self) -> None:
        """Drop what may be the beginning of a frame."""
        self.counts.bytes_dropped += len(self._bytes)
        self._bytes.clear()

    def forget(self) -> None:
        """Forget the sequence, as the core restarts or sends other telemetry: nothing is lost up to the next frame."""
        self._last = None

    def _frame(self, at: int) -> int:
        """Return bytes of what stands there: a frame, or a byte that belongs to none; 0 if more must come."""
        found = self._bytes
        telemetry = found[at] & ~(frames.SEQUENCES - 1) == frames.TELEMETRY_HEADER
        answer = bool(self.request) and found[at] == self.request[0] | 1 << frames.FROM_CORE
        if telemetry or answer:
            size = self._length if telemetry else frames.answer_length(self.request)
            if len(found) - at < size:
                return 0
            frame = bytes(found[at : at + size])
            if self._take(frame) if telemetry else self._answered(frame):
                return size
        self.counts.bytes_dropped += 1
        return 1

    def _take(self, frame: bytes) -> bool:
        try:
            sequence, words = frames.decode_telemetry(frame)
        except frames.FrameError:
            return False
        if not self.registers.possible(words):
            return False
        now = 0 if self._time is None else words[self._time]
        if self._last is not None:
            self.counts.lost += self._missing((sequence - self._last[0] - 1) % frames.SEQUENCES, now - self._last[1])
        self._last = sequence, now
        self.counts.frames += 1
        self.telemetry.append(words)
        return True

    def _missing(self, least: int, clocks: int) -> int:
        """Return frames between two: the sequence says `least`, or 16, 32 … more, and the time how many."""
        if not self.frame_clocks:
            return least
        between = clocks % (1 << 32) / self.frame_clocks - 1
        return least + frames.SEQUENCES * max(round((between - least) / frames.SEQUENCES), 0)

    def _answered(self, frame: bytes) -> bool:
        try:
            self.answer = frames.decode_answer(self.request, frame)
        except frames.FrameError:
            return False
        self.request = b""
        return True


class Link:
    """Reads and writes the registers of a core over a UART."""

    def __init__(self, port: Port, registers: HostRegisters, timeout: float = 0.5, tries: int = 4) -> None:
        self._port = port
        self._timeout, self._tries = timeout, tries
        self._sequence = 0
        self.receiver = Receiver(registers)

    def read(self, offset: int) -> int:
        """Return the register at an offset in bytes.

        It raises NoAnswer if nothing answers; ValueError if there is no such register.
        """
        return self.words(offset, 1)[0]

    def words(self, offset: int, n_words: int) -> tuple[int, ...]:
        """Return registers that follow each other."""
        return self._ask(lambda sequence: frames.read_request(offset // _WORD_BYTES, n_words, sequence)).words

    def write(self, offset: int, value: int) -> None:
        """Write the register at an offset in bytes; after a time-out it may have been written more than once."""
        self._ask(lambda sequence: frames.write_request(offset // _WORD_BYTES, value, sequence))

    def poll(self) -> Sequence[tuple[int, ...]]:
        """Return words of the frames of telemetry that have come since the last call."""
        self.receiver.feed(self._port.read(4096))
        found = list(self.receiver.telemetry)
        self.receiver.telemetry.clear()
        return found

    def _ask(self, request: Callable[[int], bytes]) -> frames.Answer:
        counts = self.receiver.counts
        frames_before, dropped_before = counts.frames, counts.bytes_dropped
        for _ in range(self._tries):
            self._sequence = (self._sequence + 1) % frames.SEQUENCES
            self.receiver.request, self.receiver.answer = request(self._sequence), None
            self._port.write(self.receiver.request)
            end = time.monotonic() + self._timeout
            while self.receiver.answer is None and time.monotonic() < end:
                self.receiver.feed(self._port.read(4096))
            if self.receiver.answer is not None:
                if self.receiver.answer.error:
                    raise ValueError("there must be a register at this address, and a written one must be writable")
                return self.receiver.answer
            self.receiver.reset()
        text = f"nothing has answered {self._tries} requests in {self._timeout:g} s each"
        raise NoAnswer(text, counts.bytes_dropped - dropped_before if counts.frames == frames_before else 0)
