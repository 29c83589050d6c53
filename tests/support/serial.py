"""Hosts on serial lines: what they put on the pins of a core, clock by clock, and what must come back.

A line changes at an instant in clocks. The clock edge at or after it samples the change; one that comes at an edge is
sampled there or a clock later.
"""

import math
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.registers import Access
from tachometry.spec.language.field import WORD
from tachometry.spec.registers import frames
from tachometry.spec.registers.frames import Answer, FrameError, Request, Type

Golden = Sequence[tuple[int | None, bool]]  # data and error of each access
_MARGIN = 0.99  # clocks before sck rises in which miso is there: those of pads and board


def encode_answer(request: Request, answer: Answer) -> bytes:
    """Return the answer to a request over the UART, as the core sends it."""
    header = 1 << frames.FROM_CORE | request.type << frames.TYPE_LOW | request.sequence
    words = b"".join(word.to_bytes(4, "little") for word in answer.words)
    return frames.with_check(bytes([header]) + words + bytes([answer.error]))


def spi_read(address: int, n_words: int = 1) -> bytes:
    """Return what to send over SPI to read words that follow each other."""
    return bytes([address]) + bytes(5 * n_words)


def spi_write(address: int, data: int) -> bytes:
    """Return what to send over SPI to write a word and to learn its status."""
    return bytes([1 << frames.SPI_ADDRESS_WIDTH | address]) + data.to_bytes(4, "big") + bytes(1)


class Host(ABC):
    """Holds the levels of lines, and the accesses that are made over them.

    - `start`: First clock of the first frame, at the earliest.
    - `words`: Width of the address of the native port.
    - `idle`: Levels of the lines at first.
    """

    def __init__(self, rng: np.random.Generator, start: int, words: int, idle: Mapping[str, int]) -> None:
        self.rng = rng
        self.time = float(start)
        self.accesses: list[Access] = []
        self._idle = idle
        self._last = (1 << words) - 1
        self._changes: dict[str, list[tuple[int, int]]] = defaultdict(list)

    def sampled(self, time: float) -> int:
        """Return the clock in which a change is sampled."""
        return math.ceil(time) + (time == int(time) and int(self.rng.integers(2)))

    def put(self, line: str, clock: int, level: int) -> None:
        """Change a line; changes come in the order of their clocks."""
        self._changes[line].append((clock, level))

    def lines(self, n_clocks: int) -> dict[str, NDArray[np.uint8]]:
        """Return levels of each line in each clock."""
        levels = {}
        for line, idle in self._idle.items():
            clocks, level = np.array([(-1, idle), *self._changes[line]]).T
            levels[line] = level[np.searchsorted(clocks, np.arange(n_clocks), side="right") - 1].astype(np.uint8)
        return levels

    def access(self, clock: int, address: int, data: int | None = None) -> int:
        """Note an access; its number."""
        self.accesses.append(Access(clock, min(address, self._last), data))
        return len(self.accesses) - 1

    @abstractmethod
    def check(self, output: NDArray[np.uint8], answers: Golden) -> None:
        """Check that what the core has sent, a level for each clock, follows from the answers to the accesses."""


class SpiHost(Host):
    """An SPI master: mosi is only right for a clock before and after sck rises, and miso is sampled early."""

    def __init__(self, rng: np.random.Generator, start: int, words: int) -> None:
        super().__init__(rng, start, words, {"spi_cs_n": 1, "spi_sck": 0, "spi_mosi": 0})
        # Clock and value of samples of miso: 0, 1, or an access and the bit of its data, -1 for its error.
        self.samples: list[tuple[int, int | tuple[int, int]]] = []

    def frame(self, sent: bytes, n_bits: int, low: float, high: float) -> None:
        """Send the first bits of a frame; sck is low and high for so many clocks."""
        bits = np.unpackbits(np.frombuffer(sent, np.uint8))[:n_bits].tolist()
        self.put("spi_cs_n", self.sampled(self.time), 0)
        rise = self.time + float(self.rng.choice([2, 2.5, low, 9]))
        address, writes, number, fall = sent[0] & 0x7F, sent[0] >> 7, -1, rise
        for k, bit in enumerate(bits):
            self.put("spi_mosi", math.ceil(rise - 1), bit)
            self.put("spi_mosi", math.ceil(rise + 1) + 1, int(self.rng.integers(2)))
            clock, fall = self.sampled(rise), rise + high
            self.put("spi_sck", clock, 1)
            self.put("spi_sck", self.sampled(fall), 0)
            group, place = divmod(k - 8, 40)
            value: int | tuple[int, int] = 0
            if k >= 8:
                # The place in the group of status and word, as if a write had its status first, too.
                status_first = (place + 8) % 40 if writes else place
                if writes and place == 31:
                    first = k - 31
                    word = int("".join(map(str, bits[first : k + 1])), 2)
                    number = self.access(clock + 3, (address + group) % 128, word)
                elif not writes and place == 0:
                    number = self.access(clock + 2, (address + group) % 128)
                if status_first == 0:
                    value = 1
                elif status_first == 7:
                    value = (number, -1)
                elif status_first > 7 and not writes:
                    value = (number, 39 - status_first)
            self.samples.append((math.ceil(rise - _MARGIN), value))
            rise = fall + low
        end = self.sampled(fall + float(self.rng.choice([2, low, 20])))
        self.put("spi_cs_n", end, 1)
        self.samples.append((end + 3, 0))
        self.time = end + float(self.rng.choice([4, 4.25, 5, 11.5]))

    def random_frame(self, control: int, velocity: int, n_words: int, longest: int) -> None:
        """A read of some words or a write, at the greatest speed or a lower one, sometimes cut off."""
        rng = self.rng
        slow = float(rng.choice([0, 0, 0, 0.125, 3]))
        low, high = 4 + slow * rng.random(), 4 + slow * rng.random()
        self.time += float(rng.choice([0, 0.25, 0.5, 0.75, rng.random()]))
        if rng.random() < 0.2:
            address = control if rng.random() < 0.7 else int(rng.integers(128))
            sent = spi_write(address, int(rng.integers(1 << WORD)))
            if rng.random() < 0.2:
                sent += rng.bytes(5)
            whole = 8 * len(sent) - 8 * int(rng.integers(2))
        else:
            address = velocity if rng.random() < 0.4 else int(rng.integers(n_words + 3))
            if rng.random() < 0.05:
                address = int(rng.integers(128))
            sent = spi_read(address, int(rng.integers(1, longest + 1)))
            sent = sent[:1] + rng.bytes(len(sent) - 1)  # what is sent meanwhile has no meaning
            whole = 8 * len(sent)
        n_bits = int(rng.integers(whole)) if rng.random() < 0.15 else whole
        self.frame(sent, n_bits, low, high)

    def check(self, output: NDArray[np.uint8], answers: Golden) -> None:
        """All samples of miso must be what the accesses have answered."""
        for clock, value in self.samples:
            if isinstance(value, tuple):
                data, error = answers[value[0]]
                if data is None and value[1] >= 0:
                    continue
                wanted = int(error) if value[1] < 0 else (data or 0) >> value[1] & 1
            else:
                wanted = value
            assert output[clock] == wanted, f"clock {clock}, {value}: {output[clock]}, not {wanted}"


class UartHost(Host):
    """A host on a UART that also damages its requests."""

    def __init__(self, rng: np.random.Generator, start: int, words: int, bit_cycles: int) -> None:
        super().__init__(rng, start, words, {"uart_rx": 1})
        self.bit = bit_cycles
        self._sent: list[tuple[int, Request, list[int]]] = []  # clock of the answer, and the accesses

    def send(self, data: bytes, *, rate: float = 1, gap: float = 0, stop: int = 1) -> int:
        """Send characters with a gap between them, so many times as fast; the clock in which the last one begins.

        `stop` is the level of the stop bit of the last.
        """
        begin = 0
        for number, byte in enumerate(data):
            self.time += gap * self.bit * (number > 0)
            last = stop if number == len(data) - 1 else 1
            begin = self.sampled(self.time)
            levels = [0, *(byte >> bit & 1 for bit in range(8)), last]
            for place, level in enumerate(levels):
                clock = begin if not place else self.sampled(self.time + place * self.bit / rate)
                self.put("uart_rx", clock, level)
            self.time += 10 * self.bit / rate
        self.put("uart_rx", math.ceil(self.time), 1)
        return begin

    def quiet(self, bits: float) -> None:
        """Leave the line alone."""
        self.time += bits * self.bit

    def pulse(self, clocks: int) -> None:
        """A line that is low for some clocks."""
        begin = math.ceil(self.time)
        self.put("uart_rx", begin, 0)
        self.put("uart_rx", begin + clocks, 1)
        self.time = begin + clocks + 1

    def exchange(self, frame: bytes, *, talk: bool = False, **how: float) -> None:
        """A right request, and its answer; `talk`: the host sends something else meanwhile."""
        begin = self.send(frame, rate=how.get("rate", 1), gap=how.get("gap", 0))
        request = frames.decode_request(frame)
        answered = begin + self.bit // 2 + 10 * self.bit + 3
        numbers = []
        if request.type is Type.WRITE:
            numbers.append(self.access(answered - 1 - self.bit, request.address, request.value))
        else:
            for word in range(request.value):
                clock = answered - 1 + 9 * self.bit + 40 * self.bit * word
                numbers.append(self.access(clock, (request.address + word) % 256))
        self._sent.append((answered, request, numbers))
        length = frames.answer_length(frame)
        if talk:
            self.quiet(float(self.rng.uniform(0, 9)))
            self.send(self.rng.bytes(min(2, length - 2)))
        self.time = answered + 10 * self.bit * length - self.bit / 2

    def dropped(self, frame: bytes, **how: float) -> None:
        """Something that is no request, and the quiet after it."""
        self.send(frame, rate=how.get("rate", 1), gap=how.get("gap", 0), stop=int(how.get("stop", 1)))
        self.quiet(frames.QUIET_BITS)

    def random_request(self, control: int, velocity: int, n_words: int, longest: int) -> bytes:
        """Return a read of some words, often from the velocity on, or a write."""
        rng, sequence = self.rng, int(self.rng.integers(frames.SEQUENCES))
        if rng.random() < 0.15:
            address = control if rng.random() < 0.7 else int(rng.integers(256))
            return frames.write_request(address, int(rng.integers(1 << WORD)), sequence)
        address = velocity if rng.random() < 0.6 else int(rng.integers(n_words + 3))
        if rng.random() < 0.05:
            address = int(rng.integers(256))
        return frames.read_request(address, int(rng.integers(longest + 1)), sequence)

    def random_exchange(self, control: int, velocity: int, n_words: int, longest: int) -> None:
        """A request at any speed that is within 3 %, with gaps between its bytes, or glitches before."""
        rng = self.rng
        frame = self.random_request(control, velocity, n_words, longest)
        if rng.random() < 0.1:
            self.pulse(int(rng.integers(1, self.bit // 2 - 1)))
            self.quiet(1)
        gap = float(rng.choice([0, 0, 0.3, 20])) if rng.random() < 0.2 else 0
        self.exchange(frame, rate=float(rng.uniform(0.97, 1.03)), gap=gap, talk=bool(rng.random() < 0.1))
        self.time += float(rng.choice([0, 0.5, 1, 100 * rng.random()]))

    def random_damage(self, control: int, velocity: int, n_words: int, longest: int) -> None:
        """A request of which something is wrong, and that must have no effect."""
        rng = self.rng
        frame = bytearray(self.random_request(control, velocity, n_words, longest))
        kind = rng.choice(["bits", "byte", "short", "gap", "stop", "type", "noise", "more", "break", "within"])
        if kind == "bits":
            for bit in rng.choice(8 * len(frame), int(rng.integers(1, 4)), replace=False).tolist():
                frame[bit // 8] ^= 1 << bit % 8
        elif kind == "byte":
            frame[int(rng.integers(len(frame)))] ^= int(rng.integers(1, 256))
        elif kind == "short":
            del frame[int(rng.integers(1, len(frame))) :]
        elif kind == "type":
            frame = bytearray(frames.with_check(bytes([frame[0] | int(rng.integers(2, 16)) << 4]) + frame[1:-2]))
        elif kind == "noise":
            frame = bytearray(rng.bytes(int(rng.integers(1, 12)))) + b"\x55"
            assert not any(_is_request(bytes(frame[:n])) for n in range(len(frame)))
        elif kind == "more":
            place = int(rng.integers(len(frame)))
            frame[place:place] = bytes([frame[place] ^ int(rng.integers(1, 256))])
            assert not any(_is_request(bytes(frame[:n])) for n in range(len(frame)))
        elif kind == "break":
            self.pulse(int(rng.integers(10, 40)) * self.bit)
            self.quiet(frames.QUIET_BITS)
            return
        if kind == "within":
            place = int(rng.integers(1, len(frame)))
            self.send(bytes(frame[:place]), stop=0)
            self.quiet(2)
            self.dropped(bytes(frame[place:]))
            return
        assert kind in ("gap", "stop") or not _is_request(bytes(frame)), kind
        self.dropped(bytes(frame), gap=frames.QUIET_BITS if kind == "gap" else 0, stop=kind != "stop")

    def check(self, output: NDArray[np.uint8], answers: Golden) -> None:
        """The line must be what the answers are, in every clock."""
        wanted = np.ones_like(output)
        for clock, request, numbers in self._sent:
            words = tuple(answers[number][0] or 0 for number in numbers) if request.type is Type.READ else ()
            answer = Answer(words, any(answers[number][1] for number in numbers))
            for place, byte in enumerate(encode_answer(request, answer)):
                at = clock + 10 * self.bit * place
                levels = [0, *(byte >> bit & 1 for bit in range(8)), 1]
                wanted[at : at + 10 * self.bit] = np.repeat(levels, self.bit)
        wrong = np.flatnonzero(output != wanted)
        assert not len(wrong), f"{len(wrong)} clocks differ, the first of them {wrong[0]}"


def _is_request(frame: bytes) -> bool:
    try:
        frames.decode_request(frame)
    except FrameError:
        return False
    return True
