"""The recorder of edges, from its pins to what the host reads."""

import numpy as np
import pytest
from proofs.formal.mutants import mutant
from support.nightly import nightly
from support.simulate import clock_by_clock

from tachometry.boards.fpga import edge_recorder
from tachometry.boards.fpga.edge_recorder import EdgeRecorder
from tachometry.boards.host.edges import read_edges
from tachometry.boards.host.link import NoAnswer

BIT, EDGES, CLOCK = 8, 6, 12_000_000


class Line:
    """A serial port whose bytes are those of a UART's levels, 8 clocks a bit."""

    def __init__(self, levels: list[int]) -> None:
        self.bytes, at = bytearray(20), 0  # noise
        while 0 in levels[at:]:
            at = levels.index(0, at) + BIT // 2
            bits = levels[at : at + 10 * BIT : BIT]
            assert bits[0] == 0
            assert bits[9] == 1
            self.bytes.append(sum(bit << place for place, bit in enumerate(bits[1:9])))
            at += 9 * BIT

    def read(self, size: int = 1, /) -> bytes:
        found = bytes(self.bytes[:7])
        del self.bytes[:7]
        return found

    def write(self, data: bytes, /) -> int:
        return len(data)


class Silent(Line):
    def read(self, size: int = 1, /) -> bytes:
        return b""


def recorded(seed: int) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return the words that the host has read, and those that the pins make."""
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.integers(0, 8, 400), rng.integers(1, 9, 400)).tolist()
    begin = int(rng.integers(20, 60))
    rows = [
        {"a": one & 1, "b": one >> 1 & 1, "z": one >> 2, "uart_rx": int(not begin <= clock < begin + 9 * BIT)}
        for clock, one in enumerate(level + level[-1:] * 2500)
    ]
    line = Line([row["uart_tx"] for row in clock_by_clock(EdgeRecorder(CLOCK, BIT, EDGES), rows, ["uart_tx"])])
    clock_hz, found = read_edges(line)
    assert clock_hz == CLOCK
    first = begin + 1  # the clock in which the request is seen, and the levels of the pins before it
    changes = [clock for clock in range(first + 1, len(level)) if level[clock] != level[clock - 1]][: EDGES - 1]
    at = [first, *changes]
    return found, [(now - before, level[now]) for before, now in zip([first, *at], at, strict=False)]


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=nightly)])
def test_edges_come_as_they_were(seed: int) -> None:
    found, expected = recorded(seed)
    assert found == expected


@nightly
@pytest.mark.parametrize(("text", "wrong"), [("Mux(write.en, 1, gap + 1)", "gap + 1"), ("place - _FIRST", "place")])
def test_wrong_recorders_are_seen(text: str, wrong: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with mutant(edge_recorder.EdgeRecorder, text, wrong):
        monkeypatch.setitem(globals(), "EdgeRecorder", edge_recorder.EdgeRecorder)
        found, expected = recorded(1)
    assert found != expected


def test_a_board_that_is_silent_is_reported() -> None:
    with pytest.raises(NoAnswer, match=r"0 bytes have come in 0 s, and no whole block of edges: turn the shaft"):
        read_edges(Silent([]), 0.0)
