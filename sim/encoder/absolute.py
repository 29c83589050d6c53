"""Models of absolute encoders: the level of the line that answers reads, see `spec.core.reads`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.core.reads import Reads, remainders

Clocks = NDArray[np.int64]


@dataclass(frozen=True)
class Answers:
    """Answers of an encoder to each of n reads."""

    position: Clocks  # shape (n,): where it is as it takes its position
    late: int = 0  # clocks of cable, both ways, and of its own
    # shape (n,) each; None: of none
    busy: Clocks | None = None  # bits for which BiSS-C lets wait
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


def frames(reads: Reads, answers: Answers) -> Clocks:
    """Return rows of bits on the line, in order: those of BiSS-C from the acknowledge to the low level at the end."""
    low = np.zeros((len(answers.position), 1), dtype=np.int64)
    position = _bits(answers.position ^ (answers.position >> 1 if reads.gray else 0), reads.width)
    if not reads.biss:
        return np.hstack([position, low] * (1 + reads.repeat))
    states = np.stack([1 - answers.of("error"), 1 - answers.of("warning")], axis=1)
    covered = np.hstack([position, states])
    table = np.array(remainders(reads.crc or 1, covered.shape[1])[::-1], dtype=np.int64)
    check = ~np.bitwise_xor.reduce(covered * table, axis=1)
    return np.hstack([low, 1 - low, low, covered, _bits(check, reads.crc_width), low])


def answer(reads: Reads, start: Clocks, answers: Answers) -> tuple[Clocks, NDArray[np.uint8]]:
    """Return the clocks in which the line changes, and its levels from them on, for reads that begin in `start`."""
    frame, period = frames(reads, answers), 2 * reads.half
    number = np.arange(frame.shape[1]) + int(reads.biss)  # of the rise: the acknowledge begins with the second one
    clock = start[:, None] + 1 + reads.half + period * number + answers.late
    clock[:, 1:] += period * answers.of("busy")[:, None] * reads.biss
    frame = frame ^ (np.arange(frame.shape[1]) == answers.of("flip", -1)[:, None])
    heard = answers.of("silent") == 0
    rests = clock[:, -1:] + reads.rest // 2
    levels = np.append(1, np.hstack([frame, frame[:, :1] * 0 + 1])[heard].ravel())
    changed = np.append(True, levels[1:] != levels[:-1])
    return np.append(0, np.hstack([clock, rests])[heard].ravel())[changed], levels[changed].astype(np.uint8)
