"""Golden model of `spec.core.extras.electrical`."""

from bisect import bisect_right
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.phase import CountedPhases, Phases, angles_of, begins
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import REFUSED_BITS, ElectricalAngle
from tachometry.spec.formats.angles import PLACE_BITS, SHOWN_BITS, Angles, Carried

Ints = NDArray[np.int64]
_TURN = 1 << SHOWN_BITS


def tables(extra: ElectricalAngle, view: View) -> dict[str, Table]:
    """Return phases, refused indices, and from each clock on what is added to a phase, and whether it is valid."""
    counts = _Counts.of(extra, view)
    phases = _phases(extra, view, counts)
    return {
        "angle_phase": Table(phases.rows[:, 0], dict(zip("abcd", phases.rows[:, 1:].T, strict=False))),
        "angle_refused": Table(counts.refused, {}),
        **_shifts(extra, view, phases),
    }


def shown(
    extra: ElectricalAngle, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the angle, whether it is valid, and how many indices were refused; a program does not clear these."""
    table, kind = found["angle_phase"], extra.phases(spec)
    rows = np.column_stack((table.clock, *table.columns.values()))
    phases = Phases(kind, rows) if isinstance(kind, Carried) else CountedPhases(kind, rows)
    columns = {
        "angle": _angle(phases, found["angle_shift"], clock),
        "angle_valid": _at(found["angle_known"], clock) > 0,
    }
    if extra.corrects(spec):
        refused = np.searchsorted(found["angle_refused"].clock, clock, side="right")
        columns["angle_refused"] = np.minimum(refused, (1 << REFUSED_BITS) - 1)
    return columns


def _at(table: Table, clock: Ints) -> Ints:
    """Return the value in each of these clocks; 0 before the first."""
    values: Ints = np.append(0, table["value"])[np.searchsorted(table.clock, clock, side="right")]
    return values


def _angle(phases: Phases | CountedPhases, shift: Table, clock: Ints) -> Ints:
    """Return the angle at the port: a phase is in a register with what is added to it."""
    before = clock - 1
    top = phases.at(before) >> phases.angles.bits - SHOWN_BITS
    return np.where(before < 0, 0, (top + _at(shift, before)) % _TURN)


def _written(trace: PinTrace, name: str, clock: Ints, value: int) -> Ints:
    """Return an input in each of these clocks, or its value where nothing drives it."""
    if name not in trace.lines:
        return np.full(len(clock), value, np.int64)
    rows = np.maximum(np.searchsorted(trace.clock, clock, side="right") - 1, 0)
    return trace.lines[name][rows].astype(np.int64)


@dataclass(frozen=True)
class _Counts:
    """Angles of counts: those since the latest index that was taken."""

    angles: Angles
    latency: int
    clock: Ints  # of the steps
    step: Ints
    taken: Ints = field(default_factory=lambda: np.empty(0, np.int64))  # clocks of indices
    refused: Ints = field(default_factory=lambda: np.empty(0, np.int64))  # clocks in which there is one more

    @classmethod
    def of(cls, extra: ElectricalAngle, view: View) -> "_Counts":
        steps, angles, latency = view.steps, extra.angles(view.spec), view.spec.latency.tick
        counted = steps.step != 0
        clock, step = steps.clock[counted], steps.step[counted].astype(np.int64)
        if not extra.corrects(view.spec):
            return cls(angles, latency, clock, step, steps.index)
        sums = np.append(0, np.cumsum(step))[np.searchsorted(clock, steps.index, side="right")].tolist()
        bits, before = angles.bits, 0
        taken, refused, origin = list[int](), list[int](), 0
        for at, total in zip(steps.index.tolist(), sums, strict=True):
            angle = int(angles_of(angles, np.array([total - origin]))[0])
            near = (angle + (1 << bits - 4)) % (1 << bits) < 1 << bits - 3
            if not taken or near or angle == before:
                taken.append(at)
                origin = total
            else:
                refused.append(at + latency + 1)
            before = angle
        return cls(angles, latency, clock, step, *(np.array(each, np.int64) for each in (taken, refused)))

    def at(self, clock: Ints) -> Ints:
        """Return the angle that the gates have in each of these clocks."""
        sums = np.append(0, np.cumsum(self.step))
        origins = np.append(0, sums[np.searchsorted(self.clock, self.taken, side="right")])
        zeros = np.searchsorted(self.taken + self.latency + 1, clock, side="right")
        counts = sums[np.searchsorted(self.clock + self.latency, clock, side="right")] - origins[zeros]
        return angles_of(self.angles, counts)

    def moves(self) -> tuple[Ints, Ints, Ints]:
        """Return clocks from which the angle differs, the angles, and the steps."""
        zeros = self.taken + self.latency + 1
        clock = np.union1d(self.clock + self.latency, zeros)
        step = np.zeros(len(clock), np.int64)
        step[np.searchsorted(clock, self.clock + self.latency)] = self.step
        return clock, self.at(clock), step


def _phases(extra: ElectricalAngle, view: View, counts: _Counts) -> Phases | CountedPhases:
    updates, kind = view.tables["update"], extra.phases(view.spec)
    begun = begins(updates.clock, kind.clocks)
    lead = _written(view.trace, "angle_lead", begun, extra.lead)
    if not isinstance(kind, Carried):
        latest = np.searchsorted(updates.clock, begun + 1, side="right") - 1
        return CountedPhases.of(kind, counts.moves(), (begun, updates["velocity"][latest], lead))
    ticks, cause = view.tables["tick"], updates["cause"]
    bits = kind.tracked.position_fine_bits
    half = 1 << bits + PLACE_BITS - 1
    place = ticks["position"][np.searchsorted(ticks.clock, cause)] << bits
    fine = (updates["position_fine"] - place + half) % (2 * half) - half
    columns = counts.at(cause), fine, updates["velocity"], updates["acceleration"], lead
    return Phases.of(kind, updates.clock, columns)


def _shifts(extra: ElectricalAngle, view: View, phases: Phases | CountedPhases) -> dict[str, Table]:
    """Return what is added to a phase, and whether the angle is valid: of sets, of the first index, of `home`."""
    trace, latency = view.trace, view.spec.latency.tick
    updates = view.tables["update"].clock
    offsets = np.append(extra.offset, _written(trace, "angle_offset", updates, extra.offset))
    changes = np.flatnonzero(np.diff(offsets))  # an update takes another offset
    offset = Table(np.append(0, updates[changes] + 1), {"value": np.append(extra.offset, offsets[changes + 1])})
    sets = np.flatnonzero(trace.lines["angle_set"]) if "angle_set" in trace.lines else np.empty(0, np.int64)
    until = np.append(trace.clock, trace.n_clocks)
    events = [(at, 0) for row in sets for at in range(int(until[row]) + 1, int(until[row + 1]) + 1)]
    events += [(int(at), 1) for at in view.steps.index + latency - 1]
    events += [(int(at), 2) for at in view.steps.arms + latency - 1]
    clocks, differences, known, indexed = [0], [0], [(0, 0)], False
    for at, kind in sorted(events):
        difference = differences[-1] if clocks[-1] <= at else differences[-2]
        if kind == 0:
            value = int(_written(trace, "angle_value", np.array([at]), 0)[0])
            before = differences[bisect_right(clocks, at - 2) - 1] if at > 1 else None
            added = 0 if before is None else before + int(_at(offset, np.array([at - 2]))[0])
            top = int(phases.at(np.array([at - 1]))[0]) >> phases.angles.bits - SHOWN_BITS
            difference += value - (top + added) % _TURN
        elif kind == 1 and not indexed:
            difference = 0
        if kind < 2 and known[-1] != (at + 1, 0):
            known.append((at + 1, 1))
        if kind == 2:
            known.append((at + 1, 0))
        indexed = kind == 1 or (indexed and kind != 2)
        clocks.append(at + 1)
        differences.append(difference)
    changed = np.unique(np.concatenate((np.array(clocks), offset.clock)))
    own = Table(np.array(clocks), {"value": np.array(differences)})
    shift = Table(changed + 1, {"value": (_at(own, changed) + _at(offset, changed)) % _TURN})
    begins, values = (np.array(each) for each in zip(*known, strict=True))
    return {"angle_shift": shift, "angle_known": Table(begins, {"value": values})}
