"""The UART bridge alone: every access, at its clock, and its line in every clock."""

from collections.abc import Callable

import numpy as np
import pytest
from support.bridge import check
from support.mutant import caught, mutant
from support.nightly import only_rows
from support.serial import UartHost

from tachometry.hdl.bus import uart
from tachometry.spec.registers import frames

WORDS, N_WORDS, CONTROL, VELOCITY = 4, 13, 2, 4
UART = uart.UartBridge


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


def damage(kind: str) -> None:
    """One kind of damage, and a right request after it."""
    host = UartHost(np.random.default_rng(0), 20, WORDS, 8)
    DAMAGE[kind](host)
    host.exchange(frames.read_request(VELOCITY, 1, 6))
    check(lambda registers: uart.UartBridge(registers, 8), host, "uart_tx")


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
    damage(kind)


MUTANTS = {
    "a bit is a clock too long": ("Mux(beat, cycles - 1, timer - 1)", "Mux(beat, cycles, timer - 1)"),
    "bits are sampled where they begin": ("timer.eq(cycles // 2 - 1)", "timer.eq(0)"),
    "a glitch is a start bit": ("ended | (beat & (place == 0) & line)", "ended"),
    "a stop bit may be low": ("m.If(~sending & ~line)", "m.If(0)"),
    "the last stop bit may be low": ("~sending & ~bad & line", "~sending & ~bad"),
    "bad requests are answered": ("~sending & ~bad & line", "~sending & line"),
    "the check is not compared": (" | (in_check & wrong)", ""),
    "the check goes on": ("m.d.sync += check.eq(CRC_START)", "m.d.sync += check.eq(check)"),
    "another polynomial": ("& CRC_POLYNOMIAL)", "& 0x8005)"),
    "any type is read": ("place > TYPE_LOW + 1", "place > 8"),
    "an answer is a request": ("place > TYPE_LOW + 1", "(place == 6) | (place == 7)"),
    "a bad request ends the line": ("number.eq(0), bad.eq(0)]", "number.eq(0)]"),
    "a gap is part of a request": ("[part.eq(_HEADER), number.eq(0), bad", "[bad"),
    "the core listens to itself": ("m.If(~busy & ~due & ~line)", "m.If(~receiving & ~due & ~line)"),
    "the address does not count": ("address[0] ^ carry", "address[0]"),
    "one word too many": ("word_ends) & more", "word_ends) & ~writing"),
    "a write reads": ("more.eq(~writing & count.any())", "more.eq(count.any())"),
    "a high address is a low one": ("| address[words:].any().replicate(words)", ""),
    "an error is not told": ("(in_address & error & (place == 1))", "0"),
    "only the last error is told": ("error.eq(error | native.error)", "error.eq(native.error)"),
    "an error stays": ("[sending.eq(1), error.eq(0), place.eq(0)]", "[sending.eq(1), place.eq(0)]"),
    "the header is that of the request": ("header[0] | (place == FROM_CORE + 1)", "header[0]"),
    "a read writes": ("answered & writing", "answered"),
    "the count does not end": ("count[0] ^ borrow", "count[0]"),
    "address and count go on in the next word": ("[carry.eq(1), borrow.eq(1)]", "[]"),
    "a write has one byte": ("~sending & ~writing)", "~sending)"),
    "a word is taken too late": ("asked.eq(native.read | native.write)", "asked.eq(ended)"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    with mutant(UART, *MUTANTS[name]), caught():
        run(0, n_frames=0)
        for kind in DAMAGE:
            damage(kind)
