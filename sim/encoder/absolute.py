"""Models of absolute encoders: the level of the line that answers reads, see `spec.core.reads`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.core.chips import POSITION_BITS, SpiReads
from tachometry.spec.core.reads import Reads, remainders
from tachometry.spec.core.tformat import CHARACTER, IDENTITY, N_CHARACTERS, PLACE, REQUEST, STATUS, TURNS, TformatReads

Clocks = NDArray[np.int64]


@dataclass(frozen=True)
class Answers:
    """Answers of an encoder to each of n reads."""

    position: Clocks  # shape (n,): where it is as it takes its position
    late: int = 0  # clocks of cable, both ways, and of its own
    # shape (n,) each; None: of none
    busy: Clocks | None = None  # bits for which BiSS-C and T-format let wait
    flip: Clocks | None = None  # a bit on the line that is wrong, −1 for none
    error: NDArray[np.bool_] | None = None
    warning: NDArray[np.bool_] | None = None
    silent: NDArray[np.bool_] | None = None  # it does not answer

    def of(self, name: str, otherwise: int = 0) -> Clocks:
        """Return one of the last five as numbers."""
        given = vars(self)[name]
        return np.full(len(self.position), otherwise, dtype=np.int64) if given is None else given.astype(np.int64)


def _bits(values: Clocks, width: int) -> Clocks:
    """Return rows of bits, the highest first."""
    return values[:, None] >> np.arange(width)[::-1] & 1


def _spi(reads: SpiReads, answers: Answers) -> Clocks:
    position = answers.position << POSITION_BITS - reads.width
    if reads.late:  # even parity, error, position
        word = position | answers.of("error") << POSITION_BITS
        return _bits(word | (_bits(word, 15).sum(axis=1) % 2) << 15, 16)
    places = _bits(position, POSITION_BITS)  # two bits make ones odd among every other bit
    checks = [1 - places[:, first::2].sum(axis=1) % 2 for first in (0, 1)]
    return np.hstack([np.stack(checks, axis=1), places])


def _tformat(reads: TformatReads, answers: Answers) -> Clocks:
    bits = reads.width - reads.turn_bits
    data = np.zeros((len(answers.position), N_CHARACTERS), dtype=np.int64)
    data[:, 0], data[:, STATUS] = REQUEST, answers.of("error") << 4 | answers.of("warning") << 5
    for first, value in ((PLACE, answers.position & (1 << bits) - 1), (TURNS, answers.position >> bits)):
        data[:, first : first + 3] = value[:, None] >> np.array([0, 8, 16]) & 0xFF
    data[:, TURNS - 1] = IDENTITY
    data[:, -1] = np.bitwise_xor.reduce(data, axis=1)
    sent = (data << 1 | 1 << CHARACTER - 1)[:, :, None] >> np.arange(CHARACTER) & 1
    return sent.reshape(len(sent), -1)


def frames(reads: Reads, answers: Answers) -> Clocks:
    """Return rows of bits on the line, in order: those of BiSS-C from the acknowledge to the low level at the end."""
    if isinstance(reads, SpiReads):
        return _spi(reads, answers)
    if isinstance(reads, TformatReads):
        return _tformat(reads, answers)
    low = np.zeros((len(answers.position), 1), dtype=np.int64)
    position = _bits(answers.position ^ (answers.position >> 1 if reads.gray else 0), reads.width)
    if not reads.biss:
        return np.hstack([position, low] * (1 + reads.repeat))
    states = np.stack([1 - answers.of("error"), 1 - answers.of("warning")], axis=1)
    covered = np.hstack([position, states])
    table = np.array(remainders(reads.crc or 1, covered.shape[1])[::-1], dtype=np.int64)
    check = ~np.bitwise_xor.reduce(covered * table, axis=1)
    return np.hstack([low, 1 - low, low, covered, _bits(check, reads.crc_width), low])


def _offsets(reads: Reads, n_bits: int, busy: Clocks) -> Clocks:
    """Return the clocks from the begin of a read until each of its bits begins."""
    if isinstance(reads, SpiReads):
        return np.array(reads.changes)
    number = np.arange(n_bits)
    if isinstance(reads, TformatReads):
        return reads.taken + reads.pause + reads.bit * (number + busy)
    period = 2 * reads.half
    # The acknowledge of BiSS-C begins with the second rise.
    offsets = np.tile(1 + reads.half + period * (number + int(reads.biss)), (len(busy), 1))
    offsets[:, 1:] += period * busy * reads.biss
    return offsets


def answer(reads: Reads, start: Clocks, answers: Answers) -> tuple[Clocks, NDArray[np.uint8]]:
    """Return the clocks in which the line changes, and its levels from them on, for reads that begin in `start`."""
    frame, busy = frames(reads, answers), answers.of("busy")[:, None]
    clock = start[:, None] + _offsets(reads, frame.shape[1], busy) + answers.late
    frame = frame ^ (np.arange(frame.shape[1]) == answers.of("flip", -1)[:, None])
    heard = answers.of("silent") == 0
    rests = clock[:, -1:] + (2 * reads.half if isinstance(reads, SpiReads | TformatReads) else reads.rest // 2)
    levels = np.append(1, np.hstack([frame, frame[:, :1] * 0 + 1])[heard].ravel())
    changed = np.append(True, levels[1:] != levels[:-1])
    return np.append(0, np.hstack([clock, rests])[heard].ravel())[changed], levels[changed].astype(np.uint8)
