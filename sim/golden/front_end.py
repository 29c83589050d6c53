"""Golden front end: from sampled levels to steps, pulse numbers and positions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.recording import PinTrace, merged
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec

# Where a pair of levels stands in the forward cycle 00, 10, 11, 01 of (A, B).
_PHASE = np.array([[0, 3], [1, 2]], dtype=np.int64)


def decode(a: NDArray[np.uint8], b: NDArray[np.uint8], decoding: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Step and illegal transition of each change of a list of levels.

    Parameters
    ----------
    a, b : uint8 arrays, shape (n,)
        Levels, each row different from the one before.
    decoding : int
        1, 2 or 4.

    Returns
    -------
    step : int64 array, shape (n − 1,)
        −1, 0 or +1.
    illegal : bool array, shape (n − 1,)
        Both lines changed.
    """
    turn = np.diff(_PHASE[a, b]) % 4
    step = np.array([0, 1, 0, -1], dtype=np.int64)[turn]
    of_a = a[1:] != a[:-1]
    counted = {4: np.ones_like(of_a), 2: of_a, 1: of_a & (b[1:] == 0)}[decoding]
    return np.where(counted, step, 0), turn == 2


def filter_line(
    clock: NDArray[np.int64], level: NDArray[np.uint8], clocks: int
) -> tuple[NDArray[np.int64], NDArray[np.uint8], NDArray[np.int64]]:
    """Glitch filter: a level counts only when it holds for so many clocks; before the first one that does, none counts.

    Parameters
    ----------
    clock, level : arrays, shape (n,)
        Change list of one line.
    clocks : int

    Returns
    -------
    clock, level : arrays
        Change list of what passes, dated when it was first sampled.
    returned : int64 array
        Clocks at which a level that did not pass went back.
    """
    lasts = np.append(clock[1:] - clock[:-1] >= clocks, True)
    first = int(np.argmax(lasts))
    clock, level, lasts = clock[first:], level[first:], lasts[first:]
    latest = np.maximum.accumulate(np.where(lasts, np.arange(len(clock)), 0))
    believed = level[latest]  # after each change, once it has held or gone
    glitch = np.flatnonzero(~lasts & (level != believed))
    changed = np.append(True, believed[1:] != believed[:-1])
    return clock[changed], level[changed], clock[glitch + 1]


def changes(trace: PinTrace, name: str) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Change list of one line: the clocks from which its levels are sampled, and the levels."""
    level = trace.lines[name]
    changed = np.append(True, level[1:] != level[:-1])
    return trace.clock[changed], level[changed]


@dataclass(frozen=True)
class Steps:
    """What the decoder sees, on the core's clock.

    Parameters
    ----------
    clock : int64 array, shape (n,)
        Clocks, increasing, with a step or where a line changes without one.
    step : int64 array, shape (n,)
        −1, 0 or +1.
    errors : int64 array
        Clocks in which `decode_error` is high.
    index : int64 array
        Clocks in which Z rises; none without an index.
    swallowed : int64 array
        Clocks in which the glitch filter has counted a glitch.
    """

    clock: NDArray[np.int64]
    step: NDArray[np.int64]
    errors: NDArray[np.int64]
    index: NDArray[np.int64]
    swallowed: NDArray[np.int64]


def decoded(spec: TachometerSpec, trace: PinTrace) -> Steps:
    """Conditioned and decoded lines."""
    lines, returned = {}, [np.empty(0, dtype=np.int64)]
    for name in ("a", "b", "z") if spec.index else ("a", "b"):
        clock, level = changes(trace, name)
        if spec.filter_clocks:
            clock, level, gone = filter_line(clock, level, spec.filter_clocks)
            returned.append(gone)
        lines[name] = clock, level
    (at_a, a), (at_b, b) = lines["a"], lines["b"]
    # From the first clock on from which both are known.
    clock = merged(at_a, at_b)
    clock = clock[clock >= max(at_a[0], at_b[0])]
    a, b = a[np.searchsorted(at_a, clock, side="right") - 1], b[np.searchsorted(at_b, clock, side="right") - 1]
    step, illegal = decode(a, b, spec.encoder.decoding)
    at = clock[1:] + spec.pin_to_count
    rises = at[:0]
    if spec.index:
        at_z, z = lines["z"]
        rises = at_z[1:][z[1:] == 1] + spec.pin_to_count
    # Two clocks for the synchroniser, one for the counter of glitches.
    return Steps(at, step, at[illegal], rises, np.sort(np.concatenate(returned)) + 3)


def first_beyond(steps: Steps, last: NDArray[np.int64], limit: int) -> NDArray[np.int64]:
    """Direction in which the sum of steps first left ±`limit` in each window; 0 where it did not."""
    found = np.zeros(len(last) + 1, dtype=np.int64)
    window = np.searchsorted(last, steps.clock, side="left")
    total = np.cumsum(steps.step)
    before = np.append(0, total)[np.searchsorted(steps.clock, last, side="right")]
    partial = total - np.append(0, before)[window]
    beyond = np.flatnonzero(np.abs(partial) > limit)[::-1]
    found[window[beyond]] = np.sign(partial[beyond])  # the first is written last
    return found[:-1]


def count(
    spec: TachometerSpec,
    steps: Steps,
    last: NDArray[np.int64],
    beyond: NDArray[np.bool_] | None = None,
) -> tuple[Table, Table]:
    """Pulse numbers and positions of all ticks, and positions at the index.

    Parameters
    ----------
    spec : TachometerSpec
    steps : Steps
    last : int64 array
        Last clock of each window.
    beyond : bool array or None
        Windows that may be longer than nominal: whether the method raises `overflow`. A sum that has left
        ±max_pulse_count is saturated, whatever comes after.
    """
    total = np.concatenate([[0], np.cumsum(steps.step)])  # total[k] = sum of the first k steps

    def steps_through(clock: NDArray[np.int64]) -> NDArray[np.int64]:
        return total[np.searchsorted(steps.clock, clock, side="right")]

    reached = steps_through(last)
    sums = np.diff(reached, prepend=0)
    overflow = np.abs(sums) > spec.max_pulse_count
    if beyond is not None:
        left = first_beyond(steps, last, spec.max_pulse_count)
        sums = np.where(left != 0, left * spec.max_pulse_count, sums)
        overflow = (left != 0) | beyond
    rises = steps.index
    captured = steps_through(rises)
    # What is taken off the position: before any index, and after each.
    origin = np.append(0, captured) if spec.index_reset else np.zeros(len(rises) + 1, dtype=np.int64)

    def wrapped(position: NDArray[np.int64]) -> NDArray[np.int64]:
        half = 1 << (spec.position_width - 1)
        return (position + half) % (2 * half) - half

    strobe = last + spec.tick_latency
    glitches = np.searchsorted(steps.swallowed, strobe, side="right")
    columns = {
        "pulse_count": np.clip(sums, -spec.max_pulse_count, spec.max_pulse_count),
        "position": wrapped(reached - origin[np.searchsorted(rises, last, side="right")]),
        "overflow": overflow,
        "swallowed_edges": 2 * np.minimum(glitches, (1 << 15) - 1),
    }
    return Table(strobe, columns), Table(rises + spec.tick_latency, {"index_position": wrapped(captured - origin[:-1])})
