"""Golden model of `spec.core.extras.electrical`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.sorted_lookup import Ints, spans
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import REFUSED, REFUSED_BITS, ElectricalAngle
from tachometry.spec.formats.angles import PLACE_BITS, SHOWN_BITS, SLOPE_BITS, Angles, Factor, wrapped

_TURN = 1 << SHOWN_BITS
_NEVER = _GROWS = _FREE = 1 << 62  # no clock, a place that grows on, and a place without an end
_SET, _INDEX, _HOME = range(3)  # events of a clock, in the order in which they act


def tables(extra: ElectricalAngle, view: View) -> dict[str, Table]:
    """Return phases, refused indices, and from each clock on the values of registers that are added to a phase."""
    counts, refused = _counts(extra, view)
    updates = view.tables["measured"].clock
    offsets = zip(updates + 1, _written(view.trace, "angle_offset", updates, extra.offset), strict=True)
    offset = _latest([(0, extra.offset), *offsets], "offset")
    phases = (_tracked if view.spec.carrying else _counted)(extra, view, counts)
    found = {"angle_phase": phases, "angle_offset": offset, REFUSED: Table(np.array(refused, np.int64), {})}
    return found | {"angle_difference": _differences(extra.angles(view.spec), view, phases, offset)}


def shown(
    extra: ElectricalAngle, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the angle, whether it is valid, and how many indices were refused; a program does not clear these."""
    differences, before = found["angle_difference"], clock - 2
    shift = _at(differences, "difference", before) + _at(found["angle_offset"], "offset", before)
    angle = (_top(extra.angles(spec), found["angle_phase"], clock - 1) + shift) % _TURN
    columns = {"angle": np.where(clock > 0, angle, 0), "angle_valid": _at(differences, "valid", clock) > 0}
    if extra.corrects(spec):
        refused = np.searchsorted(found[REFUSED].clock, clock, side="right")
        columns[REFUSED] = np.minimum(refused, (1 << REFUSED_BITS) - 1)
    return columns


def _latest(rows: Sequence[tuple[int, ...]], *names: str) -> Table:
    """Return a table with the last row of each clock, which comes first in it."""
    clock, *columns = np.array(rows, np.int64).T
    last = np.append(np.diff(clock) > 0, True)
    return Table(clock[last], {name: column[last] for name, column in zip(names, columns, strict=True)})


def _at(table: Table, name: str, clock: Ints) -> Ints:
    """Return the value in each of these clocks; 0 before the first."""
    values: Ints = np.append(0, table[name])[np.searchsorted(table.clock, clock, side="right")]
    return values


def _written(trace: PinTrace, name: str, clock: Ints, value: int) -> Ints:
    """Return an input in each of these clocks, or its value where nothing drives it."""
    return trace.at(clock)[name].astype(np.int64) if name in trace.lines else np.full(len(clock), value, np.int64)


def _counts(extra: ElectricalAngle, view: View) -> tuple[Table, list[int]]:
    """Return the angle that the gates have from each clock on, with the step in it, and when an index is refused."""
    steps, late, angles = view.steps, view.spec.latency.tick, extra.angles(view.spec)
    events = [(at, 0, step) for at, step in zip(steps.clock.tolist(), steps.step.tolist(), strict=True) if step]
    number, before, rows, refused = 0, -1, [(0, angles.of(0), 0)], list[int]()
    for at, is_index, step in sorted([*events, *((at, 1, 0) for at in steps.index.tolist())]):
        number += step
        angle = angles.of(number)
        sixteenth = 1 << angles.bits - 4
        near = (angle + sixteenth) % (1 << angles.bits) < 2 * sixteenth
        if is_index and extra.corrects(view.spec) and before >= 0 and angle != before and not near:
            refused.append(at + late + 1)
        else:
            number *= not is_index
            rows.append((at + late + is_index, angles.of(number), step))
        before = angle if is_index else before
    return _latest(rows, "angle", "step"), refused


def _tracked(extra: ElectricalAngle, view: View, counts: Table) -> Table:
    """Return the phases of updates of method track."""
    updates, ticks, angles = view.tables["measured"], view.tables["tick"], extra.angles(view.spec)
    bits, late, (of_velocity, of_fine, of_acceleration) = angles.factor_bits, angles.late, angles.factors
    place = ticks["position"][np.searchsorted(ticks.clock, updates["cause"])] << angles.position_fine_bits
    lead = _written(view.trace, "angle_lead", updates.clock, extra.lead)
    of_ticks = _at(counts, "angle", updates["cause"]), updates["position_fine"] - place, lead
    columns = np.column_stack((updates.clock, *of_ticks, updates["velocity"], updates["acceleration"])).tolist()
    rows = list[list[int]]()
    for clock, at, between, ahead, velocity, acceleration in columns:
        s, slope = angles.span + ahead, of_velocity.times(velocity)
        curve = of_acceleration.times(acceleration) << bits - SLOPE_BITS
        mean, now = (slope + Factor(t - late, bits, 0).times(curve) for t in (s >> 1, s + (angles.tick >> 1)))
        start = at + of_fine.times(wrapped(between, angles.position_fine_bits + PLACE_BITS)) + mean * s
        rows.append([clock + angles.clocks, wrapped(start, angles.bits), wrapped(now, angles.bits), 0, 0])
    return _owing(angles, rows)


def _counted(extra: ElectricalAngle, view: View, counts: Table) -> Table:
    """Return the phases of counts, updates and zeros; one is there a clock after what it follows from."""
    updates, angles = view.tables["measured"], extra.angles(view.spec)
    half = angles.count[0] >> 1
    # One that comes while the one before is multiplied takes the place of that.
    updates = updates.rows(np.diff(updates.clock, append=_NEVER) >= angles.clocks - 1)
    velocity, *_ = angles.factors
    slopes = [velocity.times(one) for one in updates["velocity"].tolist()]
    leads = (_written(view.trace, "angle_lead", updates.clock, extra.lead) + angles.span).tolist()
    ahead = [0, *(wrapped(slope * lead, angles.bits) for slope, lead in zip(slopes, leads, strict=True))]
    slopes = [0, *(max(-half, min(half, wrapped(slope, angles.bits))) for slope in slopes)]
    ends = updates.clock + angles.clocks
    clock = np.union1d(counts.clock, ends)
    latest, place = np.searchsorted(ends, clock, side="right"), np.full(len(clock), _GROWS)
    place[np.searchsorted(clock, counts.clock)] = np.where(counts["step"], -counts["step"] * half, _GROWS)
    place[0] = 0
    base, slope = _at(counts, "angle", clock) + np.array(ahead)[latest], np.array(slopes)[latest]
    return _owing(angles, np.column_stack((clock + 1, base, slope, place, 0 * clock)).tolist())


def _paid(debt: int, clocks: int, spread: int) -> int:
    """Return a debt after some clocks; one of 2^spread·q falls by q a clock until it is below that."""
    size = abs(debt)
    while clocks > 0 and (pay := size >> spread):
        some = min((size - (pay << spread)) // pay + 1, clocks)
        size, clocks = size - some * pay, clocks - some
    return -size if debt < 0 else size


def _owing(angles: Angles, rows: list[list[int]]) -> Table:
    """Return rows of clock, base, slope, place and debt, with places that grow on, and with what is owed."""
    most, lag = (_FREE, 0) if angles.tracks else (angles.count[0] >> 1, 1)
    for was, row in zip(rows, rows[1:]):  # noqa: B905, RUF007 - of one less
        clocks = row[0] - was[0]
        if row[3] == _GROWS:
            row[3] = max(-most, min(most, was[3] + was[2] * clocks))
        before = was[1] + max(-most, min(most, was[3] + was[2] * (clocks - lag)))
        row[4] = wrapped(_paid(was[4], clocks - 1, angles.spread) + before - row[1] - row[3], angles.bits)
    found = np.array(rows, np.int64).reshape(-1, 5)
    return Table(found[:, 0], {"rows": found})


def _top(angles: Angles, phases: Table, clock: Ints) -> Ints:
    """Return the phase in each of these clocks, as it is shown; 0 before the first."""
    rows, found, most = phases["rows"].tolist(), list[int](), _FREE if angles.tracks else angles.count[0] >> 1
    for at, row in zip(clock.tolist(), np.searchsorted(phases.clock, clock, side="right").tolist(), strict=True):
        first, base, slope, place, debt = rows[row - 1] if row else (at, 0, 0, 0, 0)
        grown = max(-most, min(most, place + slope * (at - first)))
        found.append((base + grown + _paid(debt, at - first, angles.spread) >> angles.bits - SHOWN_BITS) % _TURN)
    return np.array(found, np.int64)


def _differences(angles: Angles, view: View, phases: Table, offset: Table) -> Table:
    """Return by how much the angle was set, or 0 from the first index on, and whether it is valid."""
    trace, steps, late = view.trace, view.steps, view.spec.latency.tick - 1
    sets, ends = np.flatnonzero(trace.lines["angle_set"]), np.append(trace.clock, trace.n_clocks) + 1
    acts = {_SET: spans(ends[sets], ends[sets + 1])[0], _INDEX: steps.index + late, _HOME: steps.arms + late}
    rows, difference, indexed = [(0, 0, 0)], 0, False
    for at, kind in sorted((at, kind) for kind, clocks in acts.items() for at in clocks.tolist()):
        clock = np.array([at])
        if kind == _SET:
            value = _written(view.trace, "angle_value", clock, 0) - _top(angles, phases, clock)
            difference = int((value - _at(offset, "offset", clock))[0]) % _TURN
        elif kind == _INDEX and not indexed:
            difference = 0
        indexed = kind == _INDEX or (indexed and kind != _HOME)
        rows.append((at + 1, difference, int(kind != _HOME)))
    return _latest(rows, "difference", "valid")
