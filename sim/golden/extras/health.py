"""Golden model of `spec.core.extras.health`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.sorted_lookup import places
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.health import (
    FAULTS_WIDTH,
    OPEN,
    READ_COUNT_WIDTH,
    READ_COUNTS,
    READ_FAULTS,
    Fault,
    Health,
)
from tachometry.spec.language.port import INDEX

Ints = NDArray[np.int64]
_NONE = np.empty(0, dtype=np.int64)
_OTHER = {1: Fault.B_STANDS, 2: Fault.A_STANDS}  # of what changes alone


def _standing(spec: TachometerSpec, health: Health, steps: Steps) -> tuple[Ints, Ints]:
    """Return clocks in which a line has had too many edges without one of the other in a second, and the faults."""
    second = steps.clock // spec.timing.clock_hz
    anew = np.append(True, (steps.changed[1:] != steps.changed[:-1]) | (second[1:] != second[:-1]))[: len(second)]
    row = np.arange(len(second))
    number = row - np.maximum.accumulate(np.where(anew, row, 0)) + 1
    found = np.flatnonzero((number % health.edges == 0) & (steps.changed != 3))
    return steps.clock[found], np.where(steps.changed[found] == 1, _OTHER[1], _OTHER[2]).astype(np.int64)


def _illegal(spec: TachometerSpec, health: Health, errors: Ints) -> Ints:
    """Return clocks of the errors of a second that are one too many."""
    second = errors // spec.timing.clock_hz
    return errors[np.arange(len(errors)) - np.searchsorted(second, second) == health.errors]


def _index(spec: TachometerSpec, steps: Steps, index: Table) -> tuple[Ints, Ints]:
    """Return clocks after indices with which a turn was wrong, and by how many counts it went too far forward."""
    stepped = np.flatnonzero(steps.step)
    before = places(steps.clock[stepped], index.clock, "left")
    back = np.append(0, steps.step[stepped])[before] < 0
    position = index["index_position"]
    way = position[1:] - (0 if spec.front_end.index_resets else position[:-1])
    size = 1 << spec.position_width
    turn = np.where(back[1:], -spec.encoder.encoder_counts, spec.encoder.encoder_counts)
    off = (way - turn + size // 2) % size - size // 2
    presets = places(steps.presets, steps.index[: len(index)], "right")  # a turn with one of them is not checked
    wrong = (presets[1:] == presets[:-1]) & (back[1:] == back[:-1]) & (way % size != 0) & (off != 0)
    return index.clock[1:][wrong] + 1, off[wrong]


def _open(spec: TachometerSpec, health: Health, trace: PinTrace, clears: Ints) -> tuple[Ints, Ints]:
    """Return clocks in which lines have equalled their complements for too long, and the faults; what lasts when it is
    cleared is found again.
    """
    found, codes = [_NONE], [_NONE]
    for name in spec.front_end.complemented:
        equal = np.concatenate([[False], trace.lines[name] == trace.lines[f"{name}_n"], [False]])
        clock = np.append(trace.clock, trace.n_clocks) + 2  # of the synchronised lines
        begin, end = clock[equal[1:] & ~equal[:-1]], clock[~equal[1:] & equal[:-1]]
        lasts = np.searchsorted(begin, clears, side="right") > np.searchsorted(end, clears + 1, side="right")
        start = np.sort(np.append(begin, clears[lasts] + 1))
        until = np.minimum(end[np.searchsorted(end, start, side="right")], np.append(start[1:], 1 << 62))
        late = start + (health.differential or 0)
        found.append(late[late < until])
        codes.append(np.full_like(found[-1], int(OPEN[name])))
    return np.concatenate(found), np.concatenate(codes)


def tables(extra: Health, view: View) -> dict[str, Table]:
    """Return the clocks in which faults are seen, each with its code, and with the error of a wrong turn."""
    spec, steps = view.spec, view.steps
    if (reads := steps.reads) is not None:
        return {"fault": Table(reads.fault_clock, {"code": reads.fault + READ_FAULTS, "error": 0 * reads.fault})}
    standing, codes = _standing(spec, extra, steps)
    illegal = _illegal(spec, extra, steps.errors)
    wrong, off = _index(spec, steps, view.tables[INDEX]) if spec.front_end.index_watched else (_NONE, _NONE)
    opened, lines = _open(spec, extra, view.trace, view.clears)
    missed = steps.missed + spec.latency.tick
    others = {Fault.ILLEGAL: illegal, Fault.INDEX_MISSED: missed, Fault.INDEX_COUNTS: wrong}
    clock = np.concatenate([standing, opened, *others.values()])
    code = np.concatenate([codes, lines, *(np.full(len(found), int(fault)) for fault, found in others.items())])
    error = np.append(np.zeros(len(clock) - len(off), dtype=np.int64), off)
    clock, which = np.unique(clock, return_inverse=True)
    least, errors = np.full(len(clock), 1 << 62), np.zeros(len(clock), dtype=np.int64)
    np.minimum.at(least, which, code)
    np.add.at(errors, which, error)
    return {"fault": Table(clock, {"code": least, "error": errors})}


def shown(
    extra: Health, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the first fault after `cleared` and before each clock, how many there are, and the latest wrong turn."""
    faults = found["fault"]
    end = places(faults.clock, clock, "left")
    first = np.minimum(np.searchsorted(faults.clock, cleared, side="right"), end)
    turns = np.flatnonzero(faults["error"])
    latest = np.append(-1, turns)[np.searchsorted(turns, end)]
    code, error = np.append(faults["code"], 0), np.append(faults["error"], 0)
    health = np.where(end > first, code[np.where(end > first, first, -1)], 0)
    columns = {"health": health, "faults": np.minimum(end - first, (1 << FAULTS_WIDTH) - 1), "fault": health != 0}
    for name in extra.read_counts(spec):
        counted = np.isin(faults["code"] - READ_FAULTS, READ_COUNTS[name])
        number = np.diff(np.append(0, np.cumsum(counted))[np.stack([first, end])], axis=0)[0]
        columns[name] = np.minimum(number, (1 << READ_COUNT_WIDTH) - 1)
    return columns | (
        {"index_error": np.where(latest >= first, error[latest], 0)} if spec.front_end.index_watched else {}
    )
