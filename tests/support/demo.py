"""Demos for tests of hosts: compiled, or told what to do."""

from contextlib import AbstractContextManager
from functools import cache
from typing import Any

from support.serial import encode_answer
from tachometry.boards.host.registers import HostRegisters
from tachometry.sim.engines.board import BoardSimulation
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.registers import frames
from tachometry.spec.registers.buses import Bus, bus_of
from tachometry.spec.registers.demo import DemoMap, demo_manifest
from tachometry.spec.registers.demo import demo_map as map_of

BOARD = "icebreaker"
CLOCK_HZ = 12_000_000
# The core of docs/guides/monitor.md.
TEXTS = {"ppr": "500", "max-speed": "1000rad/s", "filter": "4"}
WORDS = [word for name, text in TEXTS.items() for word in (f"--{name}", text)]


def uart() -> Bus:
    bus = bus_of("uart")
    assert bus is not None
    return bus


@cache
def demo_map(method: str = "m", **more: str) -> DemoMap:
    return DemoMap(of_texts(method, {"clock": str(CLOCK_HZ), **TEXTS, **more}))


def manifest_of(registers: DemoMap) -> dict[str, Any]:
    return demo_manifest(registers, uart())


@cache
def compiled(method: str = "m") -> BoardSimulation:
    """Return the compiled demo. It is shared: stop telemetry after use."""
    return BoardSimulation(demo_map(method), uart())


class ToldBoard:
    """A board whose registers keep what is written, and whose telemetry shows what `shown` says.

    - `silent`: Nothing is answered, and nothing sent.
    - `noise`: Is sent in place of anything else.
    - `n_clocks`: That have passed since the restart.
    - `shown`: Words of captured registers by their names; others are 0.
    """

    def __init__(self, registers: DemoMap) -> None:
        self.host = HostRegisters(manifest_of(registers))
        self.words = [register.reset for register in registers]
        self._registers = registers
        self._captured = [register.name for register in registers if register.captured]
        self._tick = registers.spec.timing.tick_cycles
        self.n_clocks = self._next = self._sequence = 0
        self.silent, self.noise = False, b""
        self.shown: dict[str, int] = {}

    def word(self, name: str) -> int:
        return self.words[self.host.offset(name) // 4]

    def run(self, n_clocks: int, data: bytes = b"") -> tuple[bytes, bytes]:
        self.n_clocks += n_clocks
        if self.silent or self.noise:
            self._next = self.n_clocks
            return b"" if self.silent else self.noise, b""
        sent = b""
        while len(data) >= 5:
            size = 5 if data[0] >> frames.TYPE_LOW == frames.Type.READ else 8
            request, data = frames.decode_request(data[:size]), data[size:]
            sent += encode_answer(request, self._answer(request))
        if period := self.word("TELEMETRY") * self._tick:
            self._next = min(self._next, self.n_clocks + period)
            while self._next <= self.n_clocks:
                sent += self._telemetry()
                self._next += period
        return sent, data

    def _answer(self, request: frames.Request) -> frames.Answer:
        if request.type is frames.Type.READ:
            return frames.Answer(tuple(self.words[request.address : request.address + request.value]), error=False)
        self.words[request.address] = request.value
        if self.word("DEMO") & self.host.mask("DEMO", "restart"):
            self.words[self.host.offset("DEMO") // 4] &= ~self.host.mask("DEMO", "restart")
            self.n_clocks = self._next = 0
        return frames.Answer((), error=False)

    def _telemetry(self) -> bytes:
        words = [self.shown.get(name, 0) if name != "TIME" else self._next % (1 << 32) for name in self._captured]
        self._sequence = (self._sequence + 1) % frames.SEQUENCES
        body = b"".join(word.to_bytes(4, "little") for word in words)
        return frames.with_check(bytes([frames.TELEMETRY_HEADER | self._sequence]) + body + b"\0")


class ToldPort(AbstractContextManager["ToldPort"]):
    """The serial port of a board that tests tell what to do, and a clock of which time passes with each read."""

    def __init__(self, board: ToldBoard) -> None:
        self._board, self._waiting, self._now = board, b"", 0.0

    def monotonic(self) -> float:
        """Take the place of `time.monotonic`."""
        return self._now

    def write(self, data: bytes) -> None:
        self._waiting += data

    def read(self, size: int = 1) -> bytes:
        self._now += 0.02
        found, self._waiting = self._board.run(CLOCK_HZ // 50, self._waiting)
        return found

    def close(self) -> None:
        """Nothing is held."""

    def __exit__(self, *error: object) -> None:
        self.close()


class DemoPort:
    """A board that runs some clocks in each read, without a pseudo-terminal.

    - `n_clocks`: Of a read.
    """

    def __init__(self, spec: TachometerSpec | LoopSpec, n_clocks: int = 4000) -> None:
        self.board = BoardSimulation(map_of(spec), uart())
        self._n_clocks = n_clocks
        self._waiting = b""

    def write(self, data: bytes) -> None:
        self._waiting += data

    def read(self, size: int = 1) -> bytes:
        found, self._waiting = self.board.run(self._n_clocks, self._waiting)
        return found
