"""Golden phase of the electrical angle: what it differs from a new one is a debt, which is paid clock by clock."""

import ctypes
import functools
import itertools
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from tachometry.sim import build
from tachometry.spec.formats.angles import Angles, Carried, Counted, wrapped

_Ints = NDArray[np.int64]
# A debt of 2^spread·q falls by q a clock until it is below that: all these clocks are one step.
_PAY = """
#include <cstdint>
static int64_t paid(int64_t debt, int64_t clocks, int spread) {
  int64_t size = debt < 0 ? -debt : debt;
  for (int64_t pay; clocks > 0 && (pay = size >> spread) > 0;) {
    int64_t some = (size - (pay << spread)) / pay + 1;
    if (some > clocks) some = clocks;
    size -= some * pay, clocks -= some;
  }
  return debt < 0 ? -size : size;
}
#define CALLED extern "C" __attribute__((visibility("default")))
static int64_t held(int64_t value, int64_t most) { return value > most ? most : value < -most ? -most : value; }
static int64_t wrap(int64_t angle, int bits) { return (int64_t)((uint64_t)angle << (64 - bits)) >> (64 - bits); }
CALLED void pay(int64_t n, const int64_t* clocks, int64_t* debts, int spread) {
  for (int64_t i = 0; i < n; ++i) debts[i] = paid(debts[i], clocks[i], spread);
}
CALLED void owe(int64_t n, const int64_t* clocks, int64_t* debts, int spread, int bits) {
  for (int64_t i = 1; i < n; ++i)
    debts[i] = wrap(debts[i] + paid(debts[i - 1], clocks[i], spread), bits);
}
// Rows of clock, angle, slope, place (none: it grows on), debt; the last two are results.
CALLED void count(int64_t n, int64_t* rows, int64_t none, int64_t half, int spread, int bits) {
  for (int64_t i = 1, *row = rows + 5; i < n; ++i, row += 5) {
    int64_t *was = row - 5, span = row[0] - was[0];
    int64_t before = was[1] + held(was[3] + was[2] * (span - 1), half);
    if (row[3] == none) row[3] = held(was[3] + was[2] * span, half);
    row[4] = wrap(paid(was[4], span - 1, spread) + before - row[1] - row[3], bits);
  }
}
"""


@functools.cache
def _library() -> ctypes.CDLL | None:
    if build.find_compiler() is None:
        return None
    key = build.digest(_PAY, build.version(build.compiler()), build.compiler(), build.flags())
    return ctypes.CDLL(str(build.cached(key, ".so", lambda folder: build.compile_library(_PAY, folder))))


def _paid(debt: int, clocks: int, spread: int) -> int:
    size = abs(debt)
    while clocks > 0 and (pay := size >> spread):
        some = min((size - (pay << spread)) // pay + 1, clocks)
        size, clocks = size - some * pay, clocks - some
    return -size if debt < 0 else size


def _pay(debts: _Ints, clocks: _Ints, spread: int) -> _Ints:
    """Return debts after so many clocks each."""
    if (library := _library()) is None:
        return np.array([_paid(*each, spread) for each in zip(debts.tolist(), clocks.tolist(), strict=True)], np.int64)
    found, spans = debts.copy(), np.ascontiguousarray(clocks)
    library.pay(ctypes.c_int64(len(found)), *(ctypes.c_void_p(one.ctypes.data) for one in (spans, found)), spread)
    return found


def _owed(gaps: _Ints, clocks: _Ints, spread: int, bits: int) -> _Ints:
    """Return the debt of each phase: its gap to the one before, and what is left of the debt of that."""
    found, spans = gaps.copy(), np.ascontiguousarray(clocks)
    if (library := _library()) is not None:
        pointers = (ctypes.c_void_p(one.ctypes.data) for one in (spans, found))
        library.owe(ctypes.c_int64(len(found)), *pointers, spread, bits)
        return found
    for at in range(1, len(found)):
        left = _paid(int(found[at - 1]), int(spans[at]), spread)
        found[at] = wrapped(int(found[at]) + left, bits)
    return found


def angles_of(angles: Angles, counts: _Ints) -> _Ints:
    """Return the angles of counts since the zero."""
    turn = counts % angles.counts * angles.pole_pairs % angles.counts
    return ((turn << angles.bits) // angles.counts + angles.zero) % (1 << angles.bits)


_NONE = 1 << 62


def _counted(rows: _Ints, half: int, spread: int, bits: int) -> _Ints:
    """Return rows of clock, angle, slope, place and debt, where places that are not `_NONE` are known."""
    if (library := _library()) is not None:
        found = np.ascontiguousarray(rows)
        pointer = ctypes.c_void_p(found.ctypes.data)
        library.count(ctypes.c_int64(len(found)), pointer, *map(ctypes.c_int64, (_NONE, half)), spread, bits)
        return found
    made = rows.tolist()
    for was, row in itertools.pairwise(made):
        span = row[0] - was[0]
        grown = [max(-half, min(half, was[3] + was[2] * clocks)) for clocks in (span - 1, span)]
        if row[3] == _NONE:
            row[3] = grown[1]
        row[4] = wrapped(_paid(was[4], span - 1, spread) + was[1] + grown[0] - row[1] - row[3], bits)
    return np.array(made, np.int64)


def begins(updates: _Ints, clocks: int) -> _Ints:
    """Return clocks in which products of updates begin: one that comes while they go on waits for them."""
    if (np.diff(updates) >= clocks).all():
        return updates
    found, free, waits = list[int](), 0, False
    for update in updates.tolist():
        if waits and free < update:
            found.append(free)
            free, waits = free + clocks, False
        if update >= free:
            found.append(update)
            free, waits = update + clocks, False
        else:
            waits = True
    return np.array([*found, *[free] * waits], np.int64)


@dataclass(frozen=True)
class CountedPhases:
    """Phases of counts: what changes is in rows of clock, angle, slope, place and debt, in the order of clocks."""

    counted: Counted
    rows: _Ints

    @property
    def angles(self) -> Angles:
        """How angles are counted."""
        return self.counted.angles

    @classmethod
    def of(cls, counted: Counted, moves: tuple[_Ints, _Ints, _Ints], updates: tuple[_Ints, _Ints, _Ints]) -> Self:
        """Return the phases of angles of counts that change, and of updates.

        moves : clocks, angles from these clocks on, and steps, 0 for what is no count.
        updates : clocks in which their products begin, their velocity and lead.
        """
        bits = counted.angles.bits
        taken = [counted.carried(*each) for each in zip(*(one.tolist() for one in updates[1:]), strict=True)]
        slopes, ahead = (
            (np.array([wrapped(one, bits) for one in each], np.int64) for each in zip(*taken, strict=True))
            if taken
            else (np.empty(0, np.int64),) * 2
        )
        begun = updates[0] + counted.clocks
        clock = np.unique(np.concatenate(([0], moves[0], begun)))
        rows = np.zeros((len(clock), 5), np.int64)
        at, of = (np.searchsorted(each, clock, side="right") for each in (moves[0], begun))
        rows[:, 0] = clock
        rows[:, 1] = np.append(counted.angles.zero, moves[1])[at] + np.append(0, ahead)[of]
        rows[:, 2] = np.append(0, slopes)[of]
        steps = np.flatnonzero(moves[2])
        rows[1:, 3] = _NONE
        rows[np.searchsorted(clock, moves[0][steps]), 3] = -moves[2][steps] * counted.half
        return cls(counted, _counted(rows, counted.half, counted.angles.spread, bits))

    def at(self, clock: _Ints) -> _Ints:
        """Return the angle in each of these clocks, N bits; 0 in the first."""
        angles, half = self.angles, self.counted.half
        before = clock - 1
        row = self.rows[np.maximum(np.searchsorted(self.rows[:, 0], before, side="right") - 1, 0)].T
        since = np.maximum(before - row[0], 0)
        found = row[1] + np.clip(row[3] + row[2] * since, -half, half) + _pay(row[4], since, angles.spread)
        return np.where(before < 0, 0, found % (1 << angles.bits))


@dataclass(frozen=True)
class Phases:
    """Phases of updates, in rows of their first clock, start, slope and debt; nothing is before the first."""

    carried: Carried
    rows: _Ints

    @property
    def angles(self) -> Angles:
        """How angles are counted."""
        return self.carried.angles

    @classmethod
    def of(cls, carried: Carried, update: _Ints, columns: tuple[_Ints, ...]) -> Self:
        """Return the phases of updates; columns: what `Carried.phase` takes, in its order."""
        angles = carried.angles
        found = [carried.phase(*row) for row in zip(*(column.tolist() for column in columns), strict=True)]
        half = 1 << angles.bits - 1
        start, slope = (np.array([wrapped(row[part], angles.bits) for row in found], np.int64) for part in range(2))
        clock = update + carried.clocks
        spans = np.diff(clock, prepend=clock[:1])
        # The old phase in the clock of the new one; nothing is paid in the clock before that.
        gaps = np.append(0, start[:-1] + slope[:-1] * spans[1:])[: len(start)] - start
        gaps[:1] = 0
        debt = _owed((gaps + half) % (2 * half) - half, spans - 1, angles.spread, angles.bits)
        return cls(carried, np.column_stack((clock, start, slope, debt)))

    def at(self, clock: _Ints) -> _Ints:
        """Return the angle in each of these clocks, N bits; 0 before the first phase."""
        if not len(self.rows):
            return np.zeros(len(clock), np.int64)
        which = np.searchsorted(self.rows[:, 0], clock, side="right") - 1
        first, start, slope, debt = self.rows[np.maximum(which, 0)].T
        since = np.maximum(clock - first, 0)
        found = start + slope * since + _pay(debt, since, self.angles.spread)
        return np.where(which < 0, 0, found % (1 << self.angles.bits))
