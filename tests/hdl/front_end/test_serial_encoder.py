"""Masters of absolute encoders, at encoder models, against the golden models of their frames."""

from dataclasses import replace
from functools import reduce
from operator import xor

import numpy as np
import pytest
from proofs.formal.mutants import mutant
from support.nightly import nightly, only
from support.reads import Clocks, play

from tachometry.hdl.core.sampled_tachometer import master_of
from tachometry.sim.encoder.absolute import Answers, answer, frames
from tachometry.sim.golden.encoder_read import Line, Records, records
from tachometry.spec.core.chips import SpiReads
from tachometry.spec.core.reads import BISS_CRC, ERROR_BIT, NO_ANSWER, WRONG_CHECK, Reads, remainders
from tachometry.spec.core.tformat import TformatReads

_SLOW, _FAST, _CLOCK = 10**6, 10**7, 10**8
CASES = {
    "ssi": Reads(25, _CLOCK, 2 * _SLOW, delay=7, gray=True),
    "ssi of a long cable": Reads(25, _CLOCK, _FAST, delay=100),
    "ssi twice": Reads(25, _CLOCK, 5 * _SLOW, delay=60, gray=True, repeat=True),
    "biss": Reads(26, _CLOCK, _FAST, biss=True, crc=BISS_CRC, start_wait=600),
    "biss of 12 bits": Reads(12, 4 * _FAST, _FAST, biss=True, crc=BISS_CRC, start_wait=600),
    "biss with Gray": Reads(32, _CLOCK, _FAST, biss=True, crc=0x190D9, gray=True, start_wait=600),
    "biss with a long CRC": Reads(26, _CLOCK, _FAST, biss=True, crc=0x104C11DB7, start_wait=600),
    "biss without CRC": Reads(18, _CLOCK, _FAST, biss=True, start_wait=600),
    "as5047p": SpiReads(14, _CLOCK, 5 * _SLOW, delay=3, chip="as5047p").within(1500, 1500),
    "amt22": SpiReads(12, _CLOCK, 2 * _SLOW, chip="amt22"),
    "amt22 of 14 bits": SpiReads(14, 2 * _FAST, _SLOW, delay=12, chip="amt22"),
    "tformat": TformatReads(33, _CLOCK, 5 * _SLOW, start_wait=1000, turn_bits=16),
    "tformat of a turn": TformatReads(23, 25 * _SLOW, 5 * _SLOW // 2, delay=20, start_wait=250),
}
QUICK = ["ssi", "ssi twice", "biss", "as5047p", "tformat"]
CHECKED = [name for name, reads in CASES.items() if WRONG_CHECK in reads.reasons and "without" not in name]


def _played(name: str, n: int) -> tuple[Clocks, Records, Records]:
    """Return the position at each record, and the records of the golden model and of the master, of n reads and more.

    Some answers are wrong or missing, and some reads are due while another one runs.
    """
    reads, rng = CASES[name], np.random.default_rng([len(name), n])
    base = 100 + np.cumsum(rng.integers(reads.longest + reads.rest, reads.longest + reads.rest + 30, n))
    inside = (base + rng.integers(2, reads.longest, n))[rng.random(n) < 0.1]
    found = reads.biss or isinstance(reads, TformatReads)
    late = int(rng.integers(0, 41)) if found else reads.delay + reads.half  # the latter is as late as it may be
    answers = Answers(rng.integers(0, 1 << reads.width, n), late, rng.integers(0, 5, n))
    begin = _first_covered(reads)
    flips = rng.integers(begin, frames(reads, answers).shape[1], n)
    error, warning, silent = (rng.random(n) < 0.1 for _ in range(3))
    flip = np.where(rng.random(n) < 0.3, flips, -1)
    answers = replace(answers, flip=flip, error=error, warning=warning, silent=silent)
    line, start = answer(reads, base, answers), np.sort(np.append(base, inside))
    records_seen, levels = play(reads, start, line, int(start[-1]) + reads.longest + reads.rest)
    assert levels[1, 0] == base[0] + 1
    if type(reads) is Reads:
        # The clock rests high; between, all halves of its periods are equal.
        lasting = np.diff(levels[:, 0])
        short = lasting < reads.rest - 2 * reads.half
        assert {*lasting[short].tolist()} == {reads.half}
        assert levels[:-1][~short, 1].all()
    golden = records(reads, start, Line(*line))
    return answers.position[np.searchsorted(base, golden.clock) - 1], golden, records_seen


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
        and np.array_equal(np.minimum(golden.age[good], found.age.max()), found.age[good])
    )


@pytest.mark.parametrize("n", [400, pytest.param(100_000, marks=nightly)])
@pytest.mark.parametrize("name", only(QUICK, CASES))
def test_a_master_agrees_with_the_golden_model_and_takes_no_wrong_position(name: str, n: int) -> None:
    position, golden, found = _played(name, n)
    assert _agree(golden, found)
    good = golden.reason == 0
    assert good.any()
    assert name == "as5047p" or golden.age[good].max() <= CASES[name].oldest
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


@pytest.mark.parametrize(
    ("polynomial", "check"), [(0b1011, 0x4 ^ 0x7), (0x107, 0xF4), (0x11021, 0x31C3), (0x104C11DB7, ~0x765E7680 % 2**32)]
)
def test_other_polynomials_have_the_check_values_of_the_catalogue(polynomial: int, check: int) -> None:
    """CRC-3/GSM, CRC-8/SMBUS, CRC-16/XMODEM and CRC-32/CKSUM begin with 0; the first and the last are inverted."""
    message = int.from_bytes(b"123456789", "big")
    table = remainders(polynomial, 72)
    assert reduce(xor, (table[bit] for bit in range(72) if message >> bit & 1)) == check


# Where a line that stands is not seen as one: a frame is then wrong, or has its error bit. Of as5047p a low one is 0.
SILENT = {("as5047p", 0): {0}, ("as5047p", 1): {ERROR_BIT}}
SILENT |= {(name, 0): {WRONG_CHECK} for name in CASES if name[:3] in ("amt", "tfo")}
SILENT |= {(name, 1): {WRONG_CHECK} for name in CASES if name[:3] == "amt"}


@pytest.mark.parametrize("name", only(QUICK, CASES))
def test_a_line_that_never_answers_ends_every_read_in_time(name: str) -> None:
    reads = CASES[name]
    start = 100 + np.arange(5) * reads.least_tick
    for level in (0, 1):
        line = np.zeros(1, dtype=np.int64), np.array([level], dtype=np.uint8)
        found, _ = play(reads, start, line, int(start[-1]) + reads.longest + 1)
        assert (found.clock - start <= reads.longest).all()
        assert {*found.reason.tolist()} <= SILENT.get((name, level), {NO_ANSWER})


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
    ("as5047p", "frame.word[POSITION_BITS] | cleared", "frame.word[POSITION_BITS]"),
    ("as5047p", "& ~clears & ~cleared", "& ~clears"),
    ("as5047p", "Mux(frame.done, 1, age", "Mux(frame.done, 0, age"),
    ("as5047p", "reads.half * reads.facts.falling - ", ""),
    ("amt22", "~frame.odd.all()", "~frame.odd.any()"),
    ("amt22", "frame.left == WORD_BITS // 2 + 1", "frame.left == WORD_BITS // 2"),
    ("tformat", "frame.wrong | ~line", "frame.wrong"),
    ("tformat", "number < 8 * first + bits", "number <= 8 * first + bits"),
    ("tformat", "frame.time >= reads.last_start", "frame.time > reads.last_start"),
    ("tformat", "frame.check[0] ^ line", "frame.check[0] | line"),
    ("tformat", "(line & error)", "error"),
]


@nightly  # it asks what the tests notice
@pytest.mark.parametrize(("name", "right", "wrong"), WRONG)
def test_wrong_gates_are_seen(name: str, right: str, wrong: str) -> None:
    with mutant(type(master_of(CASES[name])), right, wrong):
        _, golden, found = _played(name, 400)
    assert not _agree(golden, found)
