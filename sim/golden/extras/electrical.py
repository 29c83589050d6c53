"""Golden model of `spec.core.extras.electrical`."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.sorted_lookup import Ints
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import LEADS, REFUSED, REFUSED_BITS, ElectricalAngle
from tachometry.spec.formats.angles import SHOWN_BITS, Angles, Factor
from tachometry.spec.formats.sine import (
    AHEAD_BITS,
    ASIDE,
    FACTOR_SHIFT,
    GUARD_BITS,
    QUARTER,
    START,
    STEPS,
    TURNS,
    WIDTH,
)

_TURN = 1 << SHOWN_BITS
_NEVER = _GROWS = _FREE = 1 << 62  # no clock, a place that grows on, and a place without an end
_LONGEST = 1 << 31  # clocks in which every place that has an end comes to it


def tables(extra: ElectricalAngle, view: View) -> dict[str, Table]:
    """Return phases, refused indices, and from each clock on the values of registers that are added to a phase."""
    states = extra.angles(view.spec).states
    ticks, read = view.tables["tick"], extra.angles(view.spec).is_read
    if read:
        counts, refused = _reads(extra, view), list[int]()
    else:
        counts, refused = (_states(states, view), []) if states else counts_of(extra, view)
    updates = view.tables["measured"].clock
    offsets = zip(updates + 1, view.trace.line_at("angle_offset", updates, extra.offset), strict=True)
    offset = _latest([(0, extra.offset), *offsets], "offset")
    phases = (_tracked if view.spec.carrying else _counted)(extra, view, counts)
    found = {"angle_phase": phases, "angle_offset": offset, REFUSED: Table(np.array(refused, np.int64), {})}
    if extra.angles(view.spec).led:
        found["angle_leads"] = _led(extra, view)
    if read:  # since when positions are valid
        begins = np.where(np.diff(ticks.position_valid, prepend=0) == 1, ticks.clock, 0)
        since = np.where(ticks.position_valid, np.maximum.accumulate(begins), _NEVER)
        found["angle_known"] = Table(np.append(0, ticks.clock), {"since": np.append(_NEVER, since)})
    known = np.maximum(counts.clock[1:2] + 1, phases.clock[:1]) if states else None
    return found | _sets(view, known)


def shown(
    extra: ElectricalAngle, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the angle, whether it is valid, and how many indices were refused; a program does not clear these."""
    angles = extra.angles(spec)
    marks, homes = (found[f"angle_{name}"].at("at", clock - 1) for name in ("index", "home"))
    valid = np.maximum(_last_set(found, clock - 1), marks) > homes
    if angles.is_read:
        done = np.append(-1, found["angle_phase"].clock - 1)
        valid = done[np.searchsorted(done, clock - 1, side="right") - 1] >= found["angle_known"].at("since", clock - 1)
    columns = {"angle": _angle(angles, found, clock), "angle_valid": valid}
    if extra.corrects(spec):
        refused = np.searchsorted(found[REFUSED].clock, clock, side="right")
        columns[REFUSED] = np.minimum(refused, (1 << REFUSED_BITS) - 1)
    columns |= {name: found["angle_leads"].at(name, clock) for name in (LEADS if angles.led else ())}
    if extra.turns:
        taken = (clock - 1) // STEPS * STEPS - STEPS
        phases = found["angle_phase"]
        row = np.searchsorted(phases.clock, taken + (not angles.tracks), side="right")
        slope = np.append(0, phases["rows"][:, 2])[row] >> angles.bits - SHOWN_BITS - AHEAD_BITS
        turn = sine_by_table if extra.sincos_table else sine_cosine
        both = turn((_angle(angles, found, taken + 1) + slope) % _TURN)
        columns |= {name: np.where(taken < 0, 0, of) for name, of in zip(("angle_sin", "angle_cos"), both, strict=True)}
    return columns


def sine_cosine(angle: Ints) -> tuple[Ints, Ints]:
    """Return sine and cosine of angles in 2^-16 turns, in 1/ONE."""
    quadrant, rest = np.divmod((angle << WIDTH - SHOWN_BITS) + (1 << WIDTH - 3), 1 << WIDTH - 2)
    rest -= 1 << WIDTH - 3
    x, y = np.full(len(angle), START), np.zeros(len(angle), np.int64)
    for step, turn in enumerate(TURNS):
        way = np.where(rest < 0, -1, 1)
        x, y, rest = x - way * (y >> step), y + way * (x >> step), rest - way * turn
    x, y = (word + (1 << GUARD_BITS - 1) >> GUARD_BITS for word in (x, y))
    vector = (x + 1j * y) * np.array([1, 1j, -1, -1j])[quadrant % 4]  # exact
    return vector.imag.astype(np.int64), vector.real.astype(np.int64)


def sine_by_table(angle: Ints) -> tuple[Ints, Ints]:
    """Return the same by the table: the other function of its entry is the slope there."""
    quadrant, rest = np.divmod(angle, _TURN // 4)
    place, aside = np.divmod(rest, 16)
    table, slope = np.array(QUARTER), np.array(ASIDE)[aside]
    both = np.array([table[place], table[~place]])

    def turned(by: Ints) -> Ints:
        which, sign = by % 2, np.where(by % 4 > 1, -1, 1)
        of, other = (np.take_along_axis(both, one[None], 0)[0] for one in (which, 1 - which))
        factor = (other >> FACTOR_SHIFT) * slope * sign * (1 - 2 * which)
        found: Ints = sign * of + (factor + 128 >> 8)
        return found

    return turned(quadrant), turned(quadrant + 1)


def _angle(angles: Angles, found: Mapping[str, Table], clock: Ints) -> Ints:
    """Return the angle at the port."""
    before, phases, offset = clock - 3, found["angle_phase"], found["angle_offset"]
    # What the angle was set to, or nothing from the first index on.
    at = _last_set(found, before)
    there, rows = np.unique(at - 1, return_inverse=True)
    difference = found["angle_value"].at("value", there) - _top(angles, phases, there) - offset.at("offset", there)
    is_set = at > found["angle_first"].at("at", before)
    shift = np.where(is_set, difference[rows], 0) + offset.at("offset", before + 1)
    angle: Ints = np.where(clock > 0, (_top(angles, phases, clock - 1) + shift) % _TURN, 0)
    return angle


def _latest(rows: Sequence[tuple[int, ...]], *names: str) -> Table:
    """Return a table with the last row of each clock, which comes first in it."""
    clock, *columns = np.array(rows, np.int64).T
    last = np.append(np.diff(clock) > 0, True)
    return Table(clock[last], {name: column[last] for name, column in zip(names, columns, strict=True)})


def counts_of(extra: ElectricalAngle, view: View, late_index: int = 1) -> tuple[Table, list[int]]:
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
            rows.append((at + late + is_index * late_index, angles.of(number), step))
        before = angle if is_index else before
    return _latest(rows, "angle", "step"), refused


def _reads(extra: ElectricalAngle, view: View) -> Table:
    """Return the angle of the read of each tick."""
    ticks, angles, turn = view.tables["tick"], extra.angles(view.spec), view.spec.encoder.encoder_counts
    angle = np.array([angles.of(place) for place in (ticks["phase"] % turn).tolist()], np.int64)
    return Table(ticks.clock, {"angle": angle, "step": np.zeros_like(angle)})


def _states(states: Mapping[int, int], view: View) -> Table:
    """Return the angle of the latest state of the halls from each clock on, with the step in it."""
    at, levels = view.steps.levels
    seen = np.append(np.diff(at) > 0, True) & np.isin(levels, [*states])
    at, levels = at[seen], levels[seen]
    moves = np.append(True, np.diff(levels) != 0)[: len(at)]
    at, angle = at[moves], [states[level] for level in levels[moves].tolist()]
    step = np.append(0, view.steps.step)[np.searchsorted(view.steps.clock, at, side="right")]
    step *= np.isin(at, view.steps.clock)
    rows = zip((at + view.spec.latency.tick).tolist(), angle, step.tolist(), strict=True)
    return _latest([(0, 0, 0), *rows], "angle", "step")


def _tracked(extra: ElectricalAngle, view: View, counts: Table) -> Table:
    """Return the phases of updates of method track."""
    updates, ticks, angles = view.tables["measured"], view.tables["tick"], extra.angles(view.spec)
    place = ticks["position"][np.searchsorted(ticks.clock, updates["cause"])] << angles.position_fine_bits
    lead = view.trace.line_at("angle_lead", updates.clock, extra.ahead)
    between = [
        wrapped(of, angles.position_fine_bits + angles.place_bits) for of in (updates["position_fine"] - place).tolist()
    ]
    of_ticks = counts.at("angle", updates["cause"]), between, lead
    columns = np.column_stack((updates.clock, *of_ticks, updates["velocity"], updates["acceleration"])).tolist()
    rows = list[list[int]]()
    for clock, at, between, ahead, velocity, acceleration in columns:
        s = angles.span + ahead
        times = (s >> 1) - angles.late, s - (s >> 1) + (angles.tick >> 1)
        mean, now = slopes_at(angles, velocity, acceleration, times)
        start = at + angles.factors[1].times(between) + mean * s
        rows.append([clock + angles.clocks, wrapped(start, angles.bits), wrapped(now, angles.bits), 0, 0])
    return _owing(angles, rows)


def slopes_at(angles: Angles, velocity: int, acceleration: int, times: Sequence[int]) -> list[int]:
    """Return slopes of the phase, each so many clocks after the one before; the first one, after the velocity."""
    of_velocity, _, of_acceleration = angles.factors
    curve, slopes = of_acceleration.times(acceleration), [of_velocity.times(velocity)]
    for time in times:
        slopes.append(slopes[-1] + Factor(time, angles.factor_bits, 0).times(curve))
    return slopes[1:]


def _led(extra: ElectricalAngle, view: View) -> Table:
    """Return velocity and position of the instant in which they are shown, and the lead after it."""
    updates, spec, angles = view.tables["measured"], view.spec, extra.angles(view.spec)
    bits, (of_curve, of_way, of_shown) = angles.factor_bits, angles.lead_factors
    span = angles.span + angles.all_clocks - angles.clocks
    ends = (view.trace.line_at("angle_lead", updates.clock, extra.ahead) + span).tolist()
    limit = angles.led.limit if angles.led else 0
    names, found = ("velocity", "acceleration", "position_fine"), list[tuple[int, int]]()
    for s, velocity, acceleration, fine in zip(ends, *(updates[name].tolist() for name in names), strict=True):
        curve = of_curve.times(acceleration)
        mean, end = (velocity + Factor(t - angles.late, bits, 0).times(curve) for t in (s >> 1, s))
        way = Factor(s, bits, 0).times(of_way.times(mean))
        width = spec.position_width + angles.position_fine_bits
        found.append((max(-limit, min(limit, of_shown.times(end))), wrapped(fine + way, width)))
    columns = np.array(found, np.int64).reshape(-1, 2).T
    return Table(updates.clock + angles.all_clocks + 1, dict(zip(LEADS, columns, strict=True)))


def _counted(extra: ElectricalAngle, view: View, counts: Table) -> Table:
    """Return the phases of counts, updates and zeros; one is there a clock after what it follows from."""
    updates, angles = view.tables["measured"], extra.angles(view.spec)
    half = angles.count[0] >> 1
    # One that comes while the one before is multiplied takes the place of that.
    updates = updates.rows(np.diff(updates.clock, append=_NEVER) >= angles.clocks - 1)
    velocity, *_ = angles.factors
    slopes = [velocity.times(one) for one in updates["velocity"].tolist()]
    leads = (view.trace.line_at("angle_lead", updates.clock, extra.ahead) + angles.span).tolist()
    ahead = [0, *(wrapped(slope * lead, angles.bits) for slope, lead in zip(slopes, leads, strict=True))]
    slopes = [0, *(max(-half, min(half, wrapped(slope, angles.bits))) for slope in slopes)]
    ends = updates.clock + angles.clocks
    clock = np.union1d(counts.clock, ends)
    latest, place = np.searchsorted(ends, clock, side="right"), np.full(len(clock), _GROWS)
    place[np.searchsorted(clock, counts.clock)] = np.where(counts["step"], -counts["step"] * half, _GROWS)
    place[0] = 0
    base, slope = counts.at("angle", clock) + np.array(ahead)[latest], np.array(slopes)[latest]
    rows = np.column_stack((clock + 1, base, slope, place, 0 * clock)).tolist()
    return _owing(angles, rows, int(counts.clock[:2][-1]) + 1 if angles.cycle else 0)


def _paid(debt: int, clocks: int, spread: int) -> int:
    """Return a debt after some clocks; one of 2^spread·q falls by q a clock until it is below that."""
    size = abs(debt)
    while clocks > 0 and size >> 2 * spread:  # q falls in each clock
        size, clocks = size - (size >> spread), clocks - 1
    while clocks > 0 and (pay := size >> spread):
        some = min((size - (pay << spread)) // pay + 1, clocks)
        size, clocks = size - some * pay, clocks - some
    return -size if debt < 0 else size


def _owing(angles: Angles, rows: list[list[int]], since: int = 0) -> Table:
    """Return rows of clock, base, slope, place and debt, with places that grow on, and debts after `since`."""
    most, lag = (_FREE, 0) if angles.tracks else (angles.count[0] >> 1, 1)
    for was, row in zip(rows, rows[1:]):  # noqa: B905, RUF007 - of one less
        clocks = row[0] - was[0]
        if row[3] == _GROWS:
            row[3] = max(-most, min(most, was[3] + was[2] * clocks))
        before = was[1] + max(-most, min(most, was[3] + was[2] * (clocks - lag)))
        gap = before - row[1] - row[3] if row[0] > since else 0
        row[4] = wrapped(_paid(was[4], clocks - 1, angles.spread) + gap, angles.bits)
    found = np.array(rows, np.int64).reshape(-1, 5)
    return Table(found[:, 0], {"rows": found})


def _top(angles: Angles, phases: Table, clock: Ints) -> Ints:
    """Return the phase in each of these clocks, as it is shown; 0 before the first."""
    most = _FREE if angles.tracks else angles.count[0] >> 1
    first, base, slope, place, debt = np.vstack((np.zeros((1, 5), np.int64), phases["rows"]))[
        np.searchsorted(phases.clock, clock, side="right")
    ].T
    clocks = np.minimum(clock - first, _LONGEST)
    size, left = np.abs(debt), clocks.copy()  # as `_paid`, for all at once
    while len(owing := np.flatnonzero((left > 0) & (size >> angles.spread > 0))):
        pay = size[owing] >> angles.spread
        some = np.minimum((size[owing] - (pay << angles.spread)) // pay + 1, left[owing])
        size[owing] -= some * pay
        left[owing] -= some
    grown = np.clip(place + slope * clocks, -most, most)
    shown: Ints = (base + grown + np.sign(debt) * size >> angles.bits - SHOWN_BITS) % _TURN
    return shown


def _sets(view: View, known: Ints | None) -> dict[str, Table]:
    """Return the spans in which the angle is set, its values, and of indices and `home` one more than their clocks.

    In one clock a set comes first, then an index, then `home`. With halls, the clock from which their angle is `known`
    takes the place of indices.
    """
    trace, late = view.trace, view.spec.latency.tick - 1
    sets, ends = np.flatnonzero(trace.lines["angle_set"]), np.append(trace.clock, trace.n_clocks) + 1
    value = trace.line_at("angle_value", trace.clock)
    marks, homes = view.steps.index + late, view.steps.arms + late
    # First is that of all, and that behind each `home`.
    turns = np.searchsorted(homes, marks, side="left")
    first = marks[np.diff(turns, prepend=-1) > 0]
    if known is not None:
        first, marks, homes = known[:0], known, known[:0]
    clocks = {"first": first, "index": marks, "home": homes}
    found = {f"angle_{name}": Table(at, {"at": at + 1}) for name, at in clocks.items()}
    spans = Table(ends[sets], {"end": ends[sets + 1]})
    return found | {"angle_sets": spans, "angle_value": Table(trace.clock, {"value": value})}


def _last_set(found: Mapping[str, Table], clock: Ints) -> Ints:
    """Return one more than the last clock in which the angle was set, not after each of these; 0 or less for none."""
    return np.minimum(found["angle_sets"].at("end", clock), clock + 1)
