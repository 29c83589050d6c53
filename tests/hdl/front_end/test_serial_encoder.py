"""The master of absolute encoders, at encoder models, against the golden model of its frames."""

from dataclasses import replace

import numpy as np
import pytest
from proofs.formal.mutants import mutant
from support.nightly import nightly, only
from support.reads import Clocks, play

from tachometry.hdl.front_end import serial_encoder
from tachometry.sim.encoder.absolute import Answers, answer, frames
from tachometry.sim.golden.encoder_read import Line, Records, records
from tachometry.spec.core.reads import BISS_CRC, NO_ANSWER, Reads

_SLOW, _FAST, _CLOCK = 10**6, 10**7, 10**8
CASES = {
    "ssi": Reads(25, _CLOCK, 2 * _SLOW, delay=7, gray=True),
    "ssi of a long cable": Reads(25, _CLOCK, _FAST, delay=100),
    "ssi twice": Reads(25, _CLOCK, 5 * _SLOW, delay=60, gray=True, repeat=True),
    "biss": Reads(26, _CLOCK, _FAST, biss=True, crc=BISS_CRC, start_wait=600),
    "biss of 12 bits": Reads(12, 4 * _FAST, _FAST, biss=True, crc=BISS_CRC, start_wait=600),
    "biss with Gray": Reads(32, _CLOCK, _FAST, biss=True, crc=0x190D9, gray=True, start_wait=600),
    "biss without CRC": Reads(18, _CLOCK, _FAST, biss=True, start_wait=600),
}
QUICK = ["ssi", "ssi twice", "biss"]
CHECKED = [name for name, reads in CASES.items() if reads.crc or reads.repeat]


def _played(name: str, n: int) -> tuple[Clocks, Records, Records]:
    """Return the position at each record, and the records of the golden model and of the master, of n reads and more.

    Some answers are wrong or missing, and some reads are due while another one runs.
    """
    reads, rng = CASES[name], np.random.default_rng([len(name), n])
    base = 100 + np.cumsum(rng.integers(reads.longest + reads.rest, reads.longest + reads.rest + 30, n))
    inside = (base + rng.integers(2, reads.longest, n))[rng.random(n) < 0.1]
    late = int(rng.integers(0, 41)) if reads.biss else reads.delay + reads.half  # the latter is as late as it may be
    answers = Answers(rng.integers(0, 1 << reads.width, n), late, rng.integers(0, 5, n))
    begin = _first_covered(reads)
    flips = rng.integers(begin, frames(reads, answers).shape[1], n)
    error, warning, silent = (rng.random(n) < 0.1 for _ in range(3))
    flip = np.where(rng.random(n) < 0.3, flips, -1)
    answers = replace(answers, flip=flip, error=error, warning=warning, silent=silent)
    line, start = answer(reads, base, answers), np.sort(np.append(base, inside))
    master = serial_encoder.SerialEncoder(reads)
    found, levels = play(master, start, line, int(start[-1]) + reads.longest + reads.rest)
    # The clock rests high; between, all halves of its periods are equal.
    lasting = np.diff(levels[:, 0])
    short = lasting < reads.rest - 2 * reads.half
    assert levels[1, 0] == base[0] + 1
    assert {*lasting[short].tolist()} == {reads.half}
    assert levels[:-1][~short, 1].all()
    golden = records(reads, start, Line(*line))
    return answers.position[np.searchsorted(base, golden.clock) - 1], golden, found


def _first_covered(reads: Reads) -> int:
    """Return the first bit that may be wrong: without its start bit a short frame can be another right one."""
    return 0 if reads.width > 18 or not reads.biss else 2


def _agree(golden: Records, found: Records) -> bool:
    good = golden.reason == 0
    return (
        np.array_equal(golden.clock, found.clock)
        and np.array_equal(golden.reason, found.reason)
        and np.array_equal(golden.warning, found.warning)
        and np.array_equal(golden.sample[good], found.sample[good])
        and np.array_equal(golden.age[good], found.age[good])
    )


@pytest.mark.parametrize("n", [400, pytest.param(100_000, marks=nightly)])
@pytest.mark.parametrize("name", only(QUICK, CASES))
def test_a_master_agrees_with_the_golden_model_and_takes_no_wrong_position(name: str, n: int) -> None:
    position, golden, found = _played(name, n)
    assert _agree(golden, found)
    good = golden.reason == 0
    assert good.any()
    assert golden.age[good].max() <= CASES[name].oldest
    if name in CHECKED:
        assert np.array_equal(found.sample[good], position[good])


@pytest.mark.parametrize("name", CHECKED)
def test_a_wrong_bit_anywhere_yields_no_wrong_position(name: str) -> None:
    reads, n = CASES[name], 20_000
    rng = np.random.default_rng(len(name))
    answers = Answers(rng.integers(0, 1 << reads.width, n), reads.delay, rng.integers(0, 5, n))
    flip = rng.integers(_first_covered(reads), frames(reads, answers).shape[1], n)
    start = 100 + np.arange(n) * reads.least_tick
    found = records(reads, start, Line(*answer(reads, start, replace(answers, flip=flip))))
    good = found.reason == 0
    assert len(found.clock) == n
    assert np.array_equal(found.sample[good], answers.position[good])


def test_frames_are_those_of_the_data_sheet() -> None:
    values, errors = np.array([0, 0x3FFFF, 0x2A5C3, 0x2A5C3]), np.array([False, False, False, True])
    sent = frames(Reads(18, _CLOCK, _FAST, biss=True, crc=BISS_CRC), Answers(values, error=errors))
    assert {tuple(row) for row in sent[:, :3].tolist()} == {(0, 1, 0)}
    assert [int("".join(map(str, row)), 2) for row in sent[:, -7:-1].tolist()] == [0x3A, 0x02, 0x3E, 0x38]


@pytest.mark.parametrize("name", only(QUICK, CASES))
def test_a_line_that_never_answers_ends_every_read_in_time(name: str) -> None:
    reads = CASES[name]
    start = 100 + np.arange(5) * reads.least_tick
    for level in (0, 1):
        line = np.zeros(1, dtype=np.int64), np.array([level], dtype=np.uint8)
        found, _ = play(serial_encoder.SerialEncoder(reads), start, line, int(start[-1]) + reads.longest + 1)
        assert (found.clock - start <= reads.longest).all()
        assert {*found.reason.tolist()} == {NO_ANSWER}


WRONG = [
    ("ssi", "frame.line ^ (frame.past & int(reads.gray))", "frame.line"),
    ("ssi twice", "frame.second & (plain ^ word[-1])", "frame.second & 0"),
    ("ssi", "frame.silent | frame.line", "frame.silent"),
    ("ssi", "reads.delay + SYNCHRONISER", "reads.delay + 1"),
    ("biss", "frame.check != self._reads.residue", "frame.check == self._reads.residue"),
    ("biss", "frame.unequal.eq(frame.line)", "frame.unequal.eq(0)"),
    ("biss", "left >= reads.crc_width", "left > reads.crc_width"),
    ("biss", "frame.time.eq(1 - reads.taken)", "frame.time.eq(0)"),
    ("biss", "frame.time == reads.start_wait", "frame.time == reads.start_wait + 1"),
    ("biss", "(left_out & frame.done)", "frame.done"),
]


@nightly  # it asks what the tests notice
@pytest.mark.parametrize(("name", "right", "wrong"), WRONG)
def test_wrong_gates_are_seen(name: str, right: str, wrong: str) -> None:
    with mutant(serial_encoder.SerialEncoder, right, wrong):
        _, golden, found = _played(name, 400)
    assert not _agree(golden, found)
