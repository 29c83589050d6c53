"""The UART bridge alone: every access, at its clock, and its line in every clock."""

from collections.abc import Callable

import numpy as np
import pytest
from support.bridge import check
from support.nightly import only_rows
from support.serial import UartHost

from tachometry.hdl.bus import uart
from tachometry.spec.registers import frames

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
