"""The golden front end of positions that are read: what each tick takes of the reads in it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.encoder_read import Line, Records, records
from tachometry.sim.golden.sampling import windows
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.reads import JUMP, NO_ANSWER, WARNING, WRONG_CHECK
from tachometry.spec.core.sampled import Reach


@dataclass(frozen=True)
class Reads:
    """Reads that are taken, and the clocks of those that are not."""

    # shape (n,): clock, position and age in clocks of each
    clock: NDArray[np.int64]
    sample: NDArray[np.int64]
    age: NDArray[np.int64]
    errors: NDArray[np.int64]
    anew: NDArray[np.bool_]  # after each of them tracking begins anew: it is far from those before
    # shape (m,): clocks of all that is wrong with reads, and what, see `spec.core.reads`
    fault_clock: NDArray[np.int64]
    fault: NDArray[np.int64]
    zero: NDArray[np.int64]  # shape (1,) or that of ticks: what is subtracted from the position
    # Of the clocks of ticks: the number of the offset of a period that is read, and what is written into one.
    exchange: Callable[[NDArray[np.int64]], tuple[NDArray[np.int64], NDArray[np.int64]]] = lambda clock: (
        0 * clock,
        0 * clock,
    )

    def exchanged(self, tick: NDArray[np.int64]) -> dict[str, NDArray[np.int64]]:
        """Return columns of ticks in these clocks."""
        return dict(zip(("asked", "written"), self.exchange(tick), strict=True))

    @classmethod
    def of(cls, spec: TachometerSpec, trace: PinTrace) -> "Reads":
        """Return the reads of a trace: there is one in every clock in which sample_valid is high, or in every tick."""
        sampled = spec.encoder.sampled
        assert sampled is not None
        if spec.reads is not None:
            level = trace.lines[spec.reads.line]
            changed = np.append(True, level[1:] != level[:-1])
            found = records(spec.reads, begins(spec, trace), Line(trace.clock[changed], level[changed]))
            return cls.those(spec, found)
        clock = trace.high("sample_valid")
        sample, right = (trace.line_at(name, clock) for name in ("sample", "sample_ok"))
        age = trace.line_at("sample_age", clock) if sampled.age is None else np.full(len(clock), sampled.age)
        return cls.those(spec, Records(clock, sample, age, WRONG_CHECK * (right == 0), right < 0))

    @classmethod
    def those(cls, spec: TachometerSpec, records: Records) -> "Reads":
        """Return the reads of records: right ones that are neither too old nor jumps are taken."""
        clock, sample, age, reason, warning = records.columns
        sampled = spec.encoder.sampled
        assert sampled is not None
        good = (reason == 0) & (age <= sampled.most_age(spec.tick.longest))
        if spec.encoder.reverse:
            sample = -sample & (1 << sampled.width) - 1
        anew, jumps, late = np.zeros(len(clock), dtype=bool), np.zeros(len(clock), dtype=bool), 0
        if spec.reach is not None:
            late = spec.reach.clocks
            good, jumps, anew = _jumps(spec.reach, clock, sample, good)
        taken = good & ~jumps
        found = dict.fromkeys((clock[taken & warning] + late).tolist(), WARNING)
        found |= zip(clock[~good].tolist(), np.where(reason == 0, NO_ANSWER, reason)[~good].tolist(), strict=True)
        found |= dict.fromkeys((clock[jumps] + late).tolist(), JUMP)
        errors = np.union1d(clock[~good], clock[jumps] + late)
        zero = np.array([spec.encoder.zero or 0])
        at, what = np.array(sorted(found.items()), dtype=np.int64).reshape(-1, 2).T
        return cls(clock[taken], sample[taken], age[taken], errors, anew[taken], at, what, zero)


def begins(spec: TachometerSpec, trace: PinTrace) -> NDArray[np.int64]:
    """Return the clocks in which reads begin."""
    return windows(spec, trace)[0] if spec.external_tick else np.array(spec.read_starts(trace.n_clocks))


def _jumps(
    reach: Reach, clock: NDArray[np.int64], sample: NDArray[np.int64], good: NDArray[np.bool_]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which good reads are checked, which of these are refused, and with which that are far all begins anew."""
    checked, refused, anew = np.zeros((3, len(clock)), dtype=bool)

    def is_far(way: int, clocks: int) -> bool:
        size, most = 1 << reach.width, reach.first + reach.step * (clocks - reach.clocks) >> reach.frac_bits
        return abs((way + size // 2) % size - size // 2) > most

    held, since, before, free = None, 0, 0, 0
    for row in np.flatnonzero(good).tolist():
        at, place = int(clock[row]), int(sample[row])
        if at < free:
            continue  # it comes while another one is compared
        checked[row], free = True, at + reach.clocks + 1
        far = held is not None and is_far(place - held, at - since)
        anew[row] = far and not is_far(place - before, at - since + 1)  # which is compared a clock later
        refused[row], before = far and not anew[row], place
        if not refused[row]:
            held, since = place, at
    return checked, refused, anew


def ways(position: NDArray[np.int64], width: int) -> NDArray[np.int64]:
    """Return how far each position of so many bits is from the one before, the first from 0: the shorter way round."""
    return wrapped(np.diff(position, prepend=0), width)


def ticks_of(spec: TachometerSpec, reads: Reads, last: NDArray[np.int64]) -> Table:
    """Return pulse numbers and positions of all ticks, with what the tracking method takes of each.

    - `last`: Last clock of each window.
    """
    sampled = spec.encoder.sampled
    assert sampled is not None
    most, number = spec.timing.max_ticks, np.arange(len(last))
    through = np.searchsorted(reads.clock, last, side="right")
    has = np.diff(through, prepend=0) > 0
    row = np.maximum(through - 1, 0)  # of the read that a tick takes
    latest = np.maximum.accumulate(np.where(has, number, -most))  # the tick of the latest read
    silent = np.minimum(number - latest, most)
    before = np.append(most, silent[:-1])
    sample = np.where(through > 0, reads.sample[row], 0) if len(reads.sample) else np.zeros_like(last)
    way = ways(sample, sampled.width)
    forgets = np.diff(np.append(0, np.cumsum(reads.anew))[through], prepend=0) > 0
    known = has & (before < most) & ~forgets
    moved = np.where(known, way, 0)
    begun = np.maximum.accumulate(np.where(has & ~known, number, 0))  # the tick of the read that is absolute
    total = np.cumsum(moved)
    position = np.where(through > 0, sample[begun] + total - total[begun], 0) - reads.zero
    limit = spec.widths.max_pulse_count
    columns = {
        "pulse_count": np.clip(moved, -limit, limit),
        "position": wrapped(position, spec.position_width),
        "overflow": np.abs(moved) > limit,
        "position_valid": silent < most,
        "number": has & ~forgets,
        "forgets": forgets,
        "times": last - reads.clock[row] + reads.age[row] if len(reads.sample) else np.zeros_like(last),
        "phase": sample,
        "silent": silent,
        "elapsed": np.minimum(before + 1, most),
        "length": np.diff(last, prepend=-1),
        **reads.exchanged(last + spec.latency.tick),
    }
    if spec.modulus is not None:
        columns["position_modulo"] = position % int(spec.modulus)
    return Table(last + spec.latency.tick, columns)


def with_presets(spec: TachometerSpec, ticks: Table, clock: NDArray[np.int64], values: NDArray[np.int64]) -> Table:
    """Return ticks whose position is set in these clocks: that of the tick before becomes the value, if it is valid."""
    shown = np.searchsorted(ticks.clock - spec.latency.tick, clock)
    valid = np.append(False, ticks.position_valid)[shown]
    clock, shown = clock[valid], shown[valid]
    # From these ticks on: it may be that one, if it waits for its remainder.
    first = np.searchsorted(ticks.clock - min(spec.latency.place + 1, spec.latency.tick), clock)
    ahead = np.append(0, ticks.position[shown - 1] - values[valid])
    position = ticks.position - ahead[np.searchsorted(first, np.arange(len(ticks)), side="right")]
    return ticks.having(position=wrapped(position, spec.position_width))
