"""Frames of telemetry, bit by bit, against what the registers answered."""

import numpy as np
import pytest
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.bus import telemetry
from tachometry.spec import of_texts
from tachometry.spec.registers import frames
from tachometry.spec.registers.demo import DemoMap

REGISTERS = DemoMap(of_texts("s", {"ppr": "500", "clock": "12MHz", "tick": "20us"}))
WORDS = [number for number, register in enumerate(REGISTERS) if register.captured]
SEEDS = range(3)
FRAME_BITS = 10 * frames.telemetry_length(len(WORDS))


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
        asked = [begin] + [begin + (10 + 40 * k) * bit_cycles for k in range(1, len(WORDS))]
        reads += [(clock, word) for clock, word in zip(asked, WORDS, strict=True) if clock < n_clocks]
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
