"""Golden model of `spec.core.extras.position_compare`: the steps that lead to positions, one after the other."""

from bisect import bisect_right
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import Steps, positions_at
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.position_compare import (
    BACKWARD,
    BOTH,
    COUNT_WIDTH,
    FORWARD,
    LIST_PINS,
    VALID,
    Compare,
    PositionCompare,
)
from tachometry.spec.formats.carrying import FASTER_BITS, Carrying

_NEVER = 1 << 62
_WAITING = "position_compare_waiting"
Clocks = list[tuple[int, int]]  # clocks, each with a number


class _Passes:
    """Finds when the shaft passes a position; `clock` and `place` are of all steps that may lead to one."""

    def __init__(self, clock: NDArray[np.int64], place: NDArray[np.int64]) -> None:
        order = np.argsort(place, kind="stable")
        self._clock, self._place = clock[order], place[order]

    def first(self, place: int, since: int) -> int:
        """Return the first clock from `since` on in which it passes there, or `_NEVER`."""
        begin, end = np.searchsorted(self._place, [place, place + 1])
        row = begin + np.searchsorted(self._clock[begin:end], since)
        return int(self._clock[row]) if row < end else _NEVER


def tables(extra: PositionCompare, view: View) -> dict[str, Table]:
    """Return the first clocks of pulses, and their positions; of a list, which the trace fills, also how long it is."""
    spec, places = view.spec, extra.places
    if places.depth:
        found, changes = _listed(places.depth, _ways(spec, places, view.steps), view.trace, spec.position_width)
        at, level = np.array([(0, 0), *changes], dtype=np.int64).T
        return {VALID: _table(found), _WAITING: Table(at, {_WAITING: np.cumsum(level)})}
    if places.fine and spec.carrying:
        return {VALID: _table([*_carried(view, places, spec.carrying)])}
    return {VALID: _table([*_computed(spec, places, view.steps, view.trace.n_clocks)])}


def _ways(spec: TachometerSpec, compare: Compare, steps: Steps) -> dict[str, _Passes]:
    """Return where the shaft passes in each direction that counts."""
    # Both ways a position is the edge below it, so a step down from it leads over it.
    place = positions_at(spec, steps, steps.clock, reset=True) + ((steps.step < 0) & (compare.direction == BOTH))
    place = wrapped(place, spec.position_width)
    clock = steps.clock + spec.latency.tick
    return {
        way: _Passes(clock[rows], place[rows])
        for way, rows in ((FORWARD, steps.step > 0), (BACKWARD, steps.step < 0))
        if compare.direction in (way, BOTH)
    }


def _sets(spec: TachometerSpec, steps: Steps) -> NDArray[np.int64]:
    """Return the clocks from which on the position is what a preset or an index has set."""
    resets = steps.index[: len(steps.index) * spec.front_end.index_resets]
    return np.sort(np.concatenate([steps.presets, resets])) + spec.latency.tick


def _carried(view: View, compare: Compare, way: Carrying) -> Iterator[tuple[int, int]]:
    """Yield the same of places between counts: that of an update, and eight times its velocity per clock for each clock
    in which it catches up, then the velocity once a clock.
    """
    spec, updates = view.spec, view.tables["measured"]
    bits = spec.position_width + way.position_fine_bits
    widest = bits + way.more_bits
    before = np.searchsorted(_sets(spec, view.steps), updates.clock - spec.latency.native_update, side="right")
    begins = [*(updates.clock + way.latency).tolist(), view.trace.n_clocks]
    columns = (updates.velocity, updates.position_fine, np.diff(before, prepend=0))
    rows = zip(begins[:-1], begins[1:], *(column.tolist() for column in columns), strict=True)
    awaited = compare.in_lsb(compare.start, way.position_fine_bits)
    armed, number = False, 0
    for clock, end, velocity, fine, jumped in [(0, begins[0], 0, 0, 0), *rows]:
        turn, since = way.per_clock.scaled(velocity << way.shift), clock
        place = (fine << way.more_bits) + (turn * way.adds << FASTER_BITS)
        armed &= not jumped
        while clock < end and (number < compare.count or not compare.count):
            beyond = wrapped(place + turn * (clock - since) - (awaited << way.more_bits), widest)
            ahead = (beyond < 0) == (compare.direction == FORWARD)
            if ahead or not armed:
                armed |= ahead
                clock += _until(beyond, turn, 1 << widest - 1)
            else:
                yield clock, awaited
                number += 1
                awaited = wrapped(awaited + compare.in_lsb(compare.apart, way.position_fine_bits), bits)
                clock += 1


def _until(value: int, turn: int, half: int) -> int:
    """Return the clocks until a number in two's complement, to which `turn` is added in each, has the other sign."""
    if not turn:
        return _NEVER
    lowest = -half if value < 0 else 0
    return (value - lowest) // -turn + 1 if turn < 0 else -((value - lowest - half) // turn)


def _table(found: Clocks) -> Table:
    clock, reached = np.array(found, dtype=np.int64).reshape(-1, 2).T
    return Table(clock + 1, {"position_compare_position": reached})


def _computed(spec: TachometerSpec, compare: Compare, steps: Steps, end: int) -> Iterator[tuple[int, int]]:
    """Yield the clocks in which positions that lie equally apart are passed, and these.

    With both directions a position that is set is followed by one position a clock, until the shaft is between two.
    """
    ways = _ways(spec, compare, steps)
    sets = _sets(spec, steps).tolist() if compare.both else []
    at = np.unique(np.append(sets, steps.clock + spec.latency.tick)) if sets else steps.clock[:0]
    place = positions_at(spec, steps, at - spec.latency.tick, reset=True)
    number = compare.passed  # of those that lie behind
    clock = -1

    def following() -> tuple[int, int, int]:
        """Return the next clock with a pulse, its position, and by how much `number` changes."""
        found = []
        for way, passes in ways.items():
            back = compare.direction == BOTH and way == BACKWARD
            if not compare.count or number != (0 if back else compare.count):
                place = wrapped(compare.start + (number - back) * compare.apart, spec.position_width)
                found.append((passes.first(place, clock + 1), place, -1 if back else 1))
        return min(found, default=(_NEVER, 0, 0))

    def aside() -> int:
        """Return the same change if the shaft is not between two positions."""
        here = int(place[np.searchsorted(at, clock + 1, side="right") - 1])
        beyond = here - compare.start - number * compare.step
        if not compare.count:
            beyond = wrapped(beyond, spec.position_width)
        above = beyond >= 0 and (number != compare.count or not compare.count)
        return above - (beyond < -compare.step and (number > 0 or not compare.count))

    for begin in [*sets, _NEVER]:
        while (found := following())[0] < begin:
            clock, number = found[0], number + found[2]
            yield found[:2]
        clock = max(clock, begin - 1)
        while clock + 1 < end and (turn := aside()):
            if (found := following())[0] == clock + 1:
                yield found[:2]
            clock, number = clock + 1, number + turn


def _listed(depth: int, ways: dict[str, _Passes], trace: PinTrace, bits: int) -> tuple[Clocks, Clocks]:
    """Return the same of a list, and by how much the list changes, from which clocks on.

    A position is awaited two clocks after it was appended, or a clock after the one before it was reached. There is
    room for one less than `depth` that are not awaited yet.
    """
    found: Clocks = []
    changes: Clocks = []
    awaited: list[int] = []  # since the list was emptied: from when each was awaited
    reached: Clocks = []  # and when it is reached, with its position

    def empty(clock: int) -> None:
        found.extend(pulse for pulse in reached if pulse[0] <= clock)
        changes.extend((min(pulse[0], clock) + 1, -1) for pulse in reached)
        awaited.clear()
        reached.clear()

    for clock, place, append, clear in _writes(trace):
        if clear:
            empty(clock)
        elif append and len(awaited) - bisect_right(awaited, clock) != depth - 1:
            awaited.append(max(clock + 2, reached[-1][0] + 1 if reached else 0))
            place = wrapped(place, bits)
            reached.append((min(passes.first(place, awaited[-1]) for passes in ways.values()), place))
            changes.append((clock + 1, 1))
    empty(_NEVER - 1)
    return found, sorted(changes)


def _writes(trace: PinTrace) -> Iterator[tuple[int, int, int, int]]:
    """Yield the clocks in which the inputs of a list act, with their levels."""
    lines = [trace.lines[name] for name in LIST_PINS]
    ends = np.append(trace.clock[1:], trace.n_clocks)
    for row in np.flatnonzero((lines[1] != 0) | (lines[2] != 0)).tolist():
        place, append, clear = (int(line[row]) for line in lines)
        for clock in range(int(trace.clock[row]), int(ends[row])):
            yield clock, place, append, clear


def shown(
    extra: PositionCompare, spec: TachometerSpec, found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the pulse, the number of pulses, and the length of a list; a program that clears does not change them."""
    pulses = found[VALID]
    number = np.searchsorted(pulses.clock, clock, side="right")
    begun = np.append(np.iinfo(np.int64).min // 2, pulses.clock)[number]
    values = {
        "position_compare": clock - begun < extra.clocks(spec),
        "position_compare_count": number % (1 << COUNT_WIDTH),
    }
    if extra.places.depth:
        waiting = found[_WAITING]
        values[_WAITING] = waiting[_WAITING][np.searchsorted(waiting.clock, clock, side="right") - 1]
    return values
