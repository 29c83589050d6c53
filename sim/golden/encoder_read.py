"""Golden model of the master of absolute encoders: from the level of its input to the records of reads."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.spec.core.chips import WORD_BITS, SpiReads
from tachometry.spec.core.reads import ERROR_BIT, NO_ANSWER, SYNCHRONISER, WRONG_CHECK, Reads, remainders
from tachometry.spec.core.tformat import (
    CHARACTER,
    ERRORS,
    N_CHARACTERS,
    PLACE,
    REQUEST,
    STATUS,
    TURNS,
    WARNINGS,
    TformatReads,
)

Clocks = NDArray[np.int64]
Bits = NDArray[np.bool_]
_LONG_AGO = -(1 << 40)


@dataclass(frozen=True)
class Records:
    """Records of reads, in the order of their strobes; each array has a row for each."""

    clock: Clocks  # of `sample_valid`
    sample: Clocks
    age: Clocks
    reason: Clocks  # 0: `sample_ok`
    warning: Bits

    @property
    def columns(self) -> tuple[NDArray[Any], ...]:
        """The arrays."""
        return (self.clock, self.sample, self.age, self.reason, self.warning)


class Line:
    """Levels of the input in the core, which follow those of the pin by the synchroniser."""

    def __init__(self, clock: Clocks, level: NDArray[np.uint8]) -> None:
        """Take the clocks in which the pin changes, and its levels from them on."""
        self._clock, self._level = clock + SYNCHRONISER, level.astype(bool)
        self._low = np.append(self._clock[~self._level], np.iinfo(np.int64).max)

    def at(self, clock: Clocks) -> Bits:
        """Return the levels in these clocks."""
        found: Bits = self._level[np.maximum(np.searchsorted(self._clock, clock, side="right") - 1, 0)]
        return found

    def next_low(self, clock: Clocks) -> Clocks:
        """Return the first clocks not before these in which the line is low."""
        found: Clocks = np.where(self.at(clock), self._low[np.searchsorted(self._low, clock)], clock)
        return found


def _number(bits: Bits) -> Clocks:
    """Return rows of bits as numbers, the highest bit first."""
    return bits.astype(np.int64) @ (1 << np.arange(bits.shape[1], dtype=np.int64)[::-1])


def _ssi(reads: Reads, start: Clocks, line: Line) -> Records:
    first = start + reads.taken + 2 * reads.half + reads.delay + SYNCHRONISER
    read = line.at(first[:, None] + 2 * reads.half * np.arange(reads.sent_bits))
    frames = read.reshape(len(start), -1, reads.frame_bits)
    values = frames[:, :, :-1]
    if reads.gray:
        values = np.logical_xor.accumulate(values, axis=2)
    silent = ~line.at(start) | frames[:, :, -1].any(axis=1)
    reason = np.where(silent, NO_ANSWER, WRONG_CHECK * (values != values[:, :1]).any(axis=(1, 2)))
    age = np.full(len(start), reads.oldest)
    return Records(start + reads.longest, _number(values[:, -1]), age, reason, silent & False)


def _biss(reads: Reads, start: Clocks, line: Line) -> Records:
    period, width = 2 * reads.half, reads.width
    taken = start + reads.taken
    limit = taken + reads.start_wait
    low = line.next_low(start + 1)
    middle = np.minimum(low, limit) + reads.half
    while (waits := (middle < limit) & ~line.at(middle)).any():
        middle[waits] += period
    in_time = (low < limit) & (middle < limit)
    read = line.at(middle[:, None] + period * np.arange(2, 2 + reads.frame_bits))
    value = np.logical_xor.accumulate(read[:, :width], axis=1) if reads.gray else read[:, :width]
    wrong = line.at(middle + period)  # CDS
    if reads.crc:
        table = np.array(remainders(reads.crc, width + 2)[::-1], dtype=np.int64)
        check = np.bitwise_xor.reduce(read[:, : width + 2] * table, axis=1)
        wrong |= check != _number(~read[:, width + 2 :])
    reason = np.where(wrong, WRONG_CHECK, ERROR_BIT * ~read[:, width])
    reason[~line.at(start) | ~in_time] = NO_ANSWER
    done = np.where(in_time, middle + period * (reads.frame_bits + 1), limit) + 1
    return Records(done, _number(value), done - taken, reason, (reason == 0) & ~read[:, width + 1])


def _spi(reads: SpiReads, start: Clocks, line: Line) -> Records:
    offsets = np.array(reads.changes) + reads.half + reads.delay + SYNCHRONISER
    read = line.at(start[:, None] + offsets)
    ones = read[:, ::2].sum(axis=1), read[:, 1::2].sum(axis=1)
    if reads.late:
        reason = np.where((ones[0] + ones[1]) % 2, WRONG_CHECK, ERROR_BIT * read[:, 1])
    else:
        reason = np.where(ones[0] * ones[1] % 2, 0, WRONG_CHECK)
    value = _number(read[:, WORD_BITS - 14 :]) >> 14 - reads.width
    return Records(start + reads.longest, value, np.full(len(start), reads.oldest), reason, reason < 0)


def _late(records: Records) -> Records:
    """Return records whose answers are to the frames before, by which the encoder takes its position or clears errors.

    After an error the next command clears it, unless it or the one before does so already.
    """
    reason = records.reason.copy()
    clears, cleared = False, False  # the command of this frame, and that of the one before
    for row, code in enumerate(reason.tolist()):
        reason[row] = ERROR_BIT if code == 0 and cleared else code
        clears, cleared = reason[row] == ERROR_BIT and not (clears or cleared), clears
    age = np.diff(records.clock, prepend=_LONG_AGO)
    return Records(records.clock, records.sample, age, reason, records.warning)


def _tformat(reads: TformatReads, start: Clocks, line: Line) -> Records:
    begin = start + reads.taken  # the start bit is waited for
    limit = begin + reads.last_start
    silent, characters = start < 0, []
    for _ in range(N_CHARACTERS):
        fall = np.minimum(line.next_low(begin), limit)
        silent = silent | (fall >= limit)
        bits = line.at(fall[:, None] + reads.bit // 2 + reads.bit * np.arange(CHARACTER))
        begin = np.where(silent, begin, fall + reads.bit // 2 + reads.bit * (CHARACTER - 1) + 1)
        characters.append(bits)
    answer = np.stack(characters, axis=1)
    data = answer[:, :, 1:-1].astype(np.int64) @ (1 << np.arange(8))
    wrong = answer[:, :, 0].any(axis=1) | ~answer[:, :, -1].all(axis=1) | (data[:, 0] != REQUEST)
    wrong |= np.bitwise_xor.reduce(data, axis=1) != 0
    place, turns = (data[:, first : first + 3] @ (1 << np.array([0, 8, 16])) for first in (PLACE, TURNS))
    width = reads.width - reads.turn_bits
    value = place & (1 << width) - 1 | (turns & (1 << reads.turn_bits) - 1) << width
    reason = np.where(wrong, WRONG_CHECK, np.where(data[:, STATUS] & ERRORS, ERROR_BIT, 0))
    reason[silent] = NO_ANSWER
    done = np.where(silent, np.maximum(begin, limit) + 1, begin)
    warning = (reason == 0) & (data[:, STATUS] & WARNINGS > 0)
    return Records(done, value, done - start - reads.taken, reason, warning)


def _of_each(reads: Reads, start: Clocks, line: Line) -> Records:
    if isinstance(reads, SpiReads):
        return _spi(reads, start, line)
    if isinstance(reads, TformatReads):
        return _tformat(reads, start, line)
    return (_biss if reads.biss else _ssi)(reads, start, line)


def records(reads: Reads, start: Clocks, line: Line) -> Records:
    """Return the records of the reads that are to begin in these clocks, increasing."""
    found = _of_each(reads, start, line)
    free, begun = -1, []
    for row, (clock, done) in enumerate(zip(start.tolist(), found.clock.tolist(), strict=True)):
        if clock >= free:
            free = done + reads.rest
            begun.append(row)
    kept = Records(*(column[begun] for column in found.columns))
    if reads.late:
        kept = _late(kept)
    left_out = np.delete(start, begun) + 1
    none = np.zeros(len(left_out), dtype=np.int64)
    added = Records(left_out + np.isin(left_out, kept.clock), none, none, none + NO_ANSWER, none > 0)
    order = np.argsort(np.append(kept.clock, added.clock), kind="stable")
    return Records(*(np.append(mine, more)[order] for mine, more in zip(kept.columns, added.columns, strict=True)))
