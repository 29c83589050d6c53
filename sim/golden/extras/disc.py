"""Golden model of `spec.core.extras.disc`."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.sorted_lookup import Ints
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.disc import DOUBTFUL, SEEN, SLIPS_BITS, SURE, UNKNOWN, DiscMap
from tachometry.spec.formats.sectors import Sectors


def displaced(extra: DiscMap, view: View) -> Steps:
    """Return the steps with the displacements of their edges, in the unit of the core; 0 where the map is not used."""
    spec, steps = view.spec, view.steps
    counts, form, found = spec.encoder.encoder_counts, extra.displacement(spec), _places(extra, view)
    writes, through = _writes(extra, view.trace), np.append(0, np.cumsum(steps.step))

    lines = extra.sectors(spec)

    def at_edge(table: Ints, edge: Ints) -> Ints:
        return _on_lines(lines, form.entry_bits, table, edge) if lines else table[edge % counts]

    def is_used(clock: Ints) -> NDArray[np.bool_]:
        return (found.at("trust", clock + 1) & 1 == 1) & (view.trace.line_at("disc_bypass", clock + 1) == 0)

    def of_edge(passed: Ints, clock: Ints) -> Ints:
        """Return the displacement of an edge by the counts since reset below it."""
        used = np.flatnonzero(is_used(clock))
        edge = (passed + found.at("moved", clock))[used]
        value = np.zeros(len(clock), np.int64)
        value[used] = _contents(extra, spec, writes, clock[used], at_edge, edge) << form.shift
        return value

    value = np.where(steps.step == 0, 0, of_edge(through[:-1] + (steps.step > 0), steps.clock))
    some = steps.step != 0

    def around(last: Ints) -> tuple[Ints, Ints]:
        """Return those of the edges above and below: that of the latest count as it was then, and the next one, also if
        it is passed in this clock.
        """
        row = np.searchsorted(steps.clock[some], last)
        back = np.append(False, steps.step[some] < 0)[row]
        latest = np.append(0, value[some])[row]
        ahead = of_edge(np.append(0, np.cumsum(steps.step[some]))[row] + ~back, last)
        at = np.searchsorted(steps.clock, last)
        ahead = np.where(passes := np.isin(last, steps.clock[some]), np.append(value, 0)[at * passes], ahead)
        return np.where(back, latest, ahead), np.where(back, ahead, latest)

    fine_bits, mapped = form.per_count.bit_length() - 2, is_used(steps.clock)
    return replace(steps, displaced=value, mapped=mapped, around=around, fine_bits=fine_bits)


def tables(extra: DiscMap, view: View) -> dict[str, Table]:
    """Return the clocks of slips, what is known of the place, and the levels of the pins."""
    found = {"disc_place": _places(extra, view), "disc_writes": _writes(extra, view.trace)}
    found["disc_pins"] = Table(view.trace.clock, view.trace.lines)
    if extra.index_place(view.spec) is not None:
        found["disc_slip"] = Table(found["disc_place"].clock[found["disc_place"].slip == 1], {})
    return found


def shown(
    extra: DiscMap, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return whether the map is used and sure, the slips since they were cleared, and the entry at the address."""
    place, pins = found["disc_place"], found["disc_pins"]
    trust = place.at("trust", clock)
    bypass = pins.at("disc_bypass", clock)
    columns: dict[str, NDArray[Any]] = {"disc_used": (trust & 1 == 1) & (bypass == 0), "disc_sure": trust == SURE}
    if extra.index_place(spec) is not None:
        slips = found["disc_slip"].clock
        number = np.searchsorted(slips, clock) - np.searchsorted(slips, cleared, side="right")
        columns["disc_slips"] = np.clip(number, 0, (1 << SLIPS_BITS) - 1)
    if extra.writable:
        address = pins.at("disc_address", clock - 1)
        entry = _contents(extra, spec, found["disc_writes"], clock - 1, np.take, _row(extra, spec, address))
        columns["disc_entry"] = np.where(clock > 0, entry, 0)
    return columns


def _writes(extra: DiscMap, trace: PinTrace) -> Table:
    """Return the clocks in which the table is written, with the edge and what is written."""
    clock = trace.high("disc_write") + 1 if extra.writable else np.empty(0, np.int64)
    return Table(clock, {name: trace.line_at(f"disc_{name}", clock) for name in ("address", "data")})


def _contents(
    extra: DiscMap, spec: TachometerSpec, writes: Table, clock: Ints, find: Callable[[Ints, Ints], Ints], at: Ints
) -> Ints:
    """Return what a table has at some places in a clock, which has all writes before it."""
    entries, value, done = extra.entries(spec), np.zeros(len(at), np.int64), 0
    table = np.zeros(1 << (len(entries) - 1).bit_length(), np.int64)
    table[: len(entries)] = entries
    row, bits = _row(extra, spec, writes.address), extra.entry_bits(spec)
    epoch = np.searchsorted(writes.clock, clock)
    for until in np.unique(epoch).tolist():
        for one in range(done, until):
            table[row[one]] = wrapped(writes.data[one], bits)
        done, now = until, epoch == until
        value[now] = find(table, at[now])
    return value


def _row(extra: DiscMap, spec: TachometerSpec, address: Ints) -> Ints:
    """Return the entry at an address; quarters repeat."""
    return address if (lines := extra.sectors(spec)) is None else np.minimum(address, lines.depth + address % 4)


def _on_lines(lines: Sectors, bits: int, table: Ints, edge: Ints) -> Ints:
    """Return the displacements of edges since the latest index from the slopes of sectors, which need not close."""
    slopes = np.append(table[np.arange(lines.edges - 1) >> lines.bits], table[len(lines.slopes) - 1])
    turns, place = np.divmod(edge, lines.edges)
    value = np.append(0, np.cumsum(slopes))[place] + turns * slopes.sum() + (1 << lines.fine - 1) >> lines.fine
    return wrapped(value + (table[lines.depth + edge % 4] if lines.quarters else 0), bits)


def _turns(view: View, busy: Ints) -> list[tuple[int, int]]:
    """Return the clocks in which the place is moved, each with the counts: the first one without a step.

    What is asked for before that takes the place of what waits.
    """
    asked = view.trace.high("disc_turn") + 1
    by = view.trace.line_at("disc_turn_by", asked)
    asked, by = (column[by < view.spec.encoder.encoder_counts] for column in (asked, by))
    found, taken = [], {*busy.tolist()}
    for clock, counts, later in zip(asked.tolist(), by.tolist(), [*asked[1:].tolist(), None], strict=False):
        at = clock + 1
        while at in taken and at <= (later or at):
            at += 1
        if later is None or at <= later:
            found.append((at, counts))
    return found


def _places(extra: DiscMap, view: View) -> Table:
    """Return from each clock on what the place is ahead of all steps, the trust in it, and whether it has slipped."""
    spec, steps, trace = view.spec, view.steps, view.trace
    counts, place = spec.encoder.encoder_counts, extra.index_place(spec)
    some = steps.step != 0
    busy, total = steps.clock[some], np.append(0, np.cumsum(steps.step[some]))
    written = _writes(extra, trace).clock
    forgets = np.union1d(trace.high("disc_forget"), written)
    events: list[tuple[int, int, int]] = [(at, 2, 0) for at in forgets.tolist()]
    if place is None:
        events += [(at, 1, by) for at, by in _turns(view, busy)]
    else:
        marks = steps.z + 1
        events += [(at, 0, place) for at in marks[~np.isin(marks, busy)].tolist()]
    moved, trust, rows = 0, UNKNOWN, [(0, 0, UNKNOWN, False)]
    for at, kind, value in sorted(events):
        slip = False
        if kind == 2:
            trust = UNKNOWN
        elif kind == 1:
            moved, trust = moved + value, SEEN
        else:
            passed = int(total[np.searchsorted(busy, at)])
            agrees = (passed + moved - value) % counts == 0
            slip, moved = trust != UNKNOWN and not agrees, value - passed
            trust = (SURE if trust != UNKNOWN else SEEN) if agrees else (SEEN if trust in (UNKNOWN, SURE) else DOUBTFUL)
        rows.append((at + 1, moved, trust, slip))
    clock, *columns = np.array(rows, np.int64).T
    return Table(clock, {name: column for name, column in zip(("moved", "trust", "slip"), columns, strict=True)})
