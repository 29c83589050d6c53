"""Masters of encoders with SPI and T-format, and models of these: words and times as data sheets have them."""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from amaranth.sim import Simulator
from support.nightly import nightly
from support.reads import Clocks, play

from tachometry.hdl.core.sampled_tachometer import master_of
from tachometry.sim.encoder.absolute import Answers, answer, frames
from tachometry.sim.golden.encoder_read import Line, records
from tachometry.spec.core.chips import SpiReads
from tachometry.spec.core.reads import ERROR_BIT, WRONG_CHECK, Reads
from tachometry.spec.core.tformat import TformatReads

HZ = 10**8
AS5047P = SpiReads(14, HZ, 10**7, chip="as5047p").within(700, 1400)
AMT22 = SpiReads(14, HZ, 2 * 10**6, chip="amt22")
TFORMAT = TformatReads(33, HZ, 5 * 10**6, start_wait=1000, turn_bits=16)


def _number(bits: Iterable[int]) -> int:
    return int("".join(map(str, bits)), 2)


@pytest.mark.parametrize(
    ("reads", "position", "word"), [(AS5047P, 0x1234, 0x9234), (AMT22, 0x21AB, 0x61AB), (AS5047P, 0, 0)]
)
def test_words_of_spi_are_those_of_the_data_sheet(reads: SpiReads, position: int, word: int) -> None:
    assert [_number(row) for row in frames(reads, Answers(np.array([position])))] == [word]


def _characters(*data: int) -> Clocks:
    return np.array([[0, *(each >> bit & 1 for bit in range(8)), 1] for each in data]).ravel()


def test_an_answer_of_tformat_is_that_of_the_data_sheet() -> None:
    """It has 17 bits of a turn; an answer to another request is none, though its last character is right."""
    sent = _characters(0x1A, 0x00, 0x45, 0x23, 0x01, 0x17, 0x02, 0x00, 0x00, 0x00, 0x68)
    assert np.array_equal(frames(TFORMAT, Answers(np.array([0x2_0000 * 2 + 0x1_2345]))), [sent])
    other = _characters(0x02, 0x00, 0x45, 0x23, 0x01, 0x17, 0x02, 0x00, 0x00, 0x00, 0x70)
    start = np.array([50, 50 + TFORMAT.least_tick])
    clock = start[:, None] + TFORMAT.taken + 300 + 20 * np.arange(110)
    line = np.append(0, clock.ravel()), np.append(1, [sent, other]).astype(np.uint8)
    found, pins = play(TFORMAT, start, line, int(start[-1]) + TFORMAT.longest)
    for each in (found, records(TFORMAT, start, Line(*line))):
        assert each.sample[0] == 0x2_0000 * 2 + 0x1_2345
        assert each.reason.tolist() == [0, WRONG_CHECK]
    # tx and de: the request lasts ten bits of 200 ns.
    level = dict(pins.tolist())
    tx = [level[max(clock for clock in level if clock <= 51 + 20 * bit + 10)] for bit in range(10)]
    assert [each & 1 for each in tx] == [0, 0, 1, 0, 1, 1, 0, 0, 0, 1]
    assert [clock for clock, each in pins.tolist() if not each & 2] == [0, 251, start[1] + 201]


@pytest.mark.parametrize("reads", [Reads(9, HZ, 10**7), AS5047P, TFORMAT])
def test_a_master_rests_after_an_upset_to_no_state(reads: Reads) -> None:
    master = master_of(reads)
    simulator, seen = Simulator(master), []

    async def play(ctx: Any) -> None:
        for state in (5, 6, 7):
            ctx.set(master.state, state)
            await ctx.tick()
            seen.append(ctx.get(master.state))

    simulator.add_clock(1e-6)
    simulator.add_testbench(play)
    simulator.run()
    assert seen[-2:] == [0, 0]


def _select(pins: Clocks) -> list[tuple[Clocks, Clocks, int, int]]:
    """Return for each frame the clocks of rises and falls of its clock, and of its begin and end."""
    clock, (sck, select) = pins[:, 0], (pins[:, 1] >> bit & 1 for bit in (0, 1))
    begin, end = (clock[1:][np.diff(select) == way] for way in (-1, 1))
    edges = [clock[1:][np.diff(sck) == way] for way in (1, -1)]
    return [
        (*(each[(each >= first) & (each <= last)] for each in edges), first, last)
        for first, last in zip(begin.tolist(), end.tolist(), strict=True)
    ]


@pytest.mark.parametrize(
    ("reads", "select_ns", "rest_ns"), [(AS5047P, 350, 350), pytest.param(AMT22, 3000, 40_000, marks=nightly)]
)
def test_lines_of_spi_keep_the_times_of_the_data_sheet(reads: SpiReads, select_ns: int, rest_ns: int) -> None:
    start = 50 + np.arange(9) * reads.least_tick
    error = np.array([0, 0, 1, 1, 0, 0, 0, 0, 0]) > 0  # until it is cleared, by the fourth command
    line = answer(reads, start, Answers(np.arange(9), error=error))
    found, pins = play(reads, start, line, int(start[-1]) + reads.longest + 1)
    seen = _select(pins)
    assert len(seen) == 9
    for rises, falls, begin, end in seen:
        assert len(rises) == len(falls) == 16
        assert min(rises[0] - begin, end - falls[-1]) >= select_ns // 10
        assert min(*(falls - rises), *(rises[1:] - falls[:-1])) >= HZ // (2 * reads.facts.fastest_hz)
        assert reads is AS5047P or rises[8] - falls[7] >= select_ns // 10
    assert min(later[2] - each[3] for each, later in pairwise(seen)) >= rest_ns // 10
    mosi = [[pins[np.searchsorted(pins[:, 0], at, "right") - 1, 1] >> 2 for at in falls] for _, falls, *_ in seen]
    if reads is AMT22:
        assert not np.any(mosi)
        return
    assert [_number(bits) for bits in mosi] == [0xFFFF, 0xFFFF, 0xFFFF, 0x4001, *[0xFFFF] * 5]
    # The answer to the command that clears is no position; the first has no command before it.
    assert found.reason.tolist() == [0, 0, ERROR_BIT, ERROR_BIT, ERROR_BIT, 0, 0, 0, 0]
    assert found.age.tolist() == [4095, *[reads.least_tick] * 8]
