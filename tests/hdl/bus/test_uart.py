"""The UART bridge alone: every access, at its clock, and its line in every clock."""

from collections.abc import Callable

import numpy as np
import pytest
from support.bridge import check
from support.nightly import only, only_rows
from support.serial import SpiHost, UartHost
from support.simulate import clock_by_clock

from tachometry.hdl.bus import spi, telemetry, uart
from tachometry.spec import of_texts
from tachometry.spec.registers import frames
from tachometry.spec.registers.demo import DemoMap
from tachometry.spec.registers.frames import SPI_SCK_CYCLES

WORDS, N_WORDS, CONTROL, VELOCITY = 4, 13, 2, 4


def run(seed: int, bit_cycles: int = 8, n_frames: int = 10) -> None:
    """Right requests and damaged ones."""
    rng = np.random.default_rng(seed)
    host = UartHost(rng, 20, WORDS, bit_cycles)
    host.exchange(frames.read_request(VELOCITY, 3, 5), rate=1.03, gap=20)
    host.exchange(frames.write_request(0xF2, 0x8001C3A5, 15), rate=0.97)
    host.exchange(frames.read_request(CONTROL, 4, 5))
    host.dropped(frames.write_request(CONTROL, 1)[:-1] + b"\x00")
    host.exchange(frames.read_request(0x10 | CONTROL, 2, 10), talk=True)
    host.exchange(frames.read_request(255, 2))
    host.exchange(frames.read_request(VELOCITY, 0))
    for _ in range(n_frames):
        host.random_damage(CONTROL, VELOCITY, N_WORDS, 3)
        host.random_exchange(CONTROL, VELOCITY, N_WORDS, 3)
    check(lambda registers: uart.UartBridge(registers, bit_cycles), host, "uart_tx")


FRAME = frames.write_request(CONTROL, 1)


def low_within(host: UartHost) -> None:
    """A stop bit that is low, then a pause in which the line rests."""
    host.send(FRAME[:3], stop=0)
    host.quiet(2)
    host.dropped(FRAME[3:])


def low_for(host: UartHost, clocks: int, bits: float) -> None:
    """A line that is low for a while, then quiet."""
    host.pulse(clocks)
    host.quiet(bits)


DAMAGE: dict[str, Callable[[UartHost], None]] = {
    "gap": lambda host: host.dropped(FRAME, gap=frames.QUIET_BITS),
    "type": lambda host: host.dropped(frames.with_check(bytes([0x42, 1, 1]))),
    "answer": lambda host: host.dropped(frames.with_check(bytes([0x82, 1, 1]))),
    "stop": lambda host: host.dropped(FRAME, stop=0),
    "stop within": low_within,
    "short": lambda host: host.dropped(FRAME[:-1]),
    "check": lambda host: host.dropped(FRAME[:-1] + bytes([FRAME[-1] ^ 0x80])),
    "glitch": lambda host: low_for(host, 3, 0.5),
    "break": lambda host: low_for(host, 600, frames.QUIET_BITS),
}


# Bits of 15 clocks take twice as many.
@pytest.mark.parametrize(("seed", "bit_cycles"), only_rows([(0, 8)], [(0, 8), (1, 15)]))
def test_accesses_and_answers(seed: int, bit_cycles: int) -> None:
    run(seed, bit_cycles)


@pytest.mark.parametrize("kind", DAMAGE)
def test_damaged_requests_have_no_effect(kind: str) -> None:
    """One kind of damage, and a right request after it."""
    host = UartHost(np.random.default_rng(0), 20, WORDS, 8)
    DAMAGE[kind](host)
    host.exchange(frames.read_request(VELOCITY, 1, 6))
    check(lambda registers: uart.UartBridge(registers, 8), host, "uart_tx")


# The SPI bridge alone: every access, at its clock, and every bit that it sends.
FRAMES = 12


def at_the_limit(host: SpiHost, half: float = SPI_SCK_CYCLES / 2) -> None:
    """Frames in which sck is low and high for so many clocks, in every phase to the clock."""
    for phase in (0, 0.25, 0.5, 0.75):
        host.time = np.ceil(host.time) + phase
        host.frame(bytes([VELOCITY, *host.rng.bytes(10)]), 88, half, half)
        host.frame(bytes([0x80 | CONTROL, *host.rng.bytes(5)]), 48, half, half)


@pytest.mark.parametrize("seed", range(2))
def test_accesses_and_answers_of_spi(seed: int) -> None:
    """Random frames, of which the first ones are at the greatest speed."""
    rng = np.random.default_rng(seed)
    host = SpiHost(rng, 20, WORDS)
    at_the_limit(host)
    for _ in range(FRAMES):
        host.random_frame(CONTROL, VELOCITY, N_WORDS, 3)
    check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")


def test_the_limit_is_no_lower() -> None:
    """At a higher speed miso would come too late."""
    host = SpiHost(np.random.default_rng(0), 20, WORDS)
    at_the_limit(host, SPI_SCK_CYCLES / 2 - 1)
    with pytest.raises(AssertionError, match=r"^clock \d+, "):
        check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")


def test_unselected() -> None:
    """A clock on sck while another chip is selected, and a frame that was under way at reset."""
    host = SpiHost(np.random.default_rng(0), 1, WORDS)
    host.put("spi_cs_n", 0, 0)
    for clock in range(2, 802, 8):
        host.put("spi_sck", clock, 1)
        host.put("spi_sck", clock + 4, 0)
        host.put("spi_mosi", clock - 1, clock >> 4 & 1)
        host.samples.append((clock, 0))
    host.put("spi_cs_n", 500, 1)
    host.time = 820.0
    host.frame(bytes([VELOCITY, 0, 0, 0, 0, 0]), 48, 4, 4)
    check(lambda registers: spi.SpiBridge(registers), host, "spi_miso")


# Frames of telemetry, bit by bit, against what the registers answered.
REGISTERS = DemoMap(of_texts("s", {"ppr": "500", "clock": "12MHz", "tick": "20us"}))
TELEMETRY_WORDS = [number for number, register in enumerate(REGISTERS) if register.captured]
SEEDS = range(3)
FRAME_BITS = 10 * frames.telemetry_length(len(TELEMETRY_WORDS))


@pytest.mark.parametrize("seed", only(SEEDS[:1], SEEDS))  # one has frames of every kind
def test_frames_show_what_was_captured(seed: int) -> None:
    """A sender with random requests and pauses, and registers whose answers are random."""
    rng = np.random.default_rng(seed)
    bit_cycles = int(rng.integers(8, 12))
    n_clocks = 5 * FRAME_BITS * bit_cycles
    sends = rng.random(n_clocks) < 4 / (FRAME_BITS * bit_cycles)
    wait = np.zeros(n_clocks, dtype=bool)
    for begin in rng.integers(0, n_clocks, 4).tolist():
        wait[begin : begin + int(rng.integers(1, FRAME_BITS * bit_cycles))] = True
    answers = rng.integers(0, 1 << 32, n_clocks)
    rows = [
        {"send": int(send), "wait": int(held), "native.read_data": int(answer)}
        for send, held, answer in zip(sends, wait, answers, strict=True)
    ]
    names = ["line", "busy", "native.read", "native.write", "native.address"]
    seen = clock_by_clock(telemetry.TelemetrySender(REGISTERS, bit_cycles), rows, names)
    line, busy, read, write, address = (np.array([row[name] for row in seen]) for name in names)
    assert not write.any()

    # Frames begin in the clock after they were wanted, or when they need not wait; the latest that is wanted is sent.
    wanted, until, begins, sequence = False, 0, [], 0
    for clock in range(n_clocks):
        if wanted and clock >= until and not wait[clock]:
            begins.append((clock, sequence % frames.SEQUENCES))
            until, wanted = clock + FRAME_BITS * bit_cycles + 1, False
        wanted |= bool(sends[clock])
        sequence += int(sends[clock])
    assert begins

    level, under_way, reads = np.ones(n_clocks, dtype=int), np.zeros(n_clocks, dtype=int), []
    for begin, number in begins:
        # The first word is read when the frame begins, each other when the word before it ends.
        asked = [begin] + [begin + (10 + 40 * k) * bit_cycles for k in range(1, len(TELEMETRY_WORDS))]
        reads += [(clock, word) for clock, word in zip(asked, TELEMETRY_WORDS, strict=True) if clock < n_clocks]
        words = b"".join(int(answers[(clock + 1) % n_clocks]).to_bytes(4, "little") for clock in asked)
        header = 1 << frames.FROM_CORE | frames.Type.TELEMETRY << frames.TYPE_LOW | number
        frame = frames.with_check(bytes([header]) + words + bytes(1))
        if begin + FRAME_BITS * bit_cycles < n_clocks:
            assert frames.decode_telemetry(frame)[0] == number
        bits = [bit for byte in frame for bit in (0, *(byte >> k & 1 for k in range(8)), 1)]
        first = begin + 1 + bit_cycles
        under_way[begin + 1 : begin + 1 + FRAME_BITS * bit_cycles] = 1
        shown = np.repeat(bits, bit_cycles)[: max(n_clocks - first, 0)]
        level[first : first + len(shown)] = shown
    assert [(clock, int(address[clock])) for clock in np.flatnonzero(read).tolist()] == sorted(reads)
    np.testing.assert_array_equal(busy, under_way, f"seed {seed}: busy")
    np.testing.assert_array_equal(line, level, f"seed {seed}: line")
