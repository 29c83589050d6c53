"""Golden model of `spec.core.extras.probe`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import positions_at
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.probe import FALLING, RISING, Probe
from tachometry.spec.language.port import FINE

Ints = NDArray[np.int64]


def tables(extra: Probe, view: View) -> dict[str, Table]:
    """Return what each probe latches, and as `probed` when one of them has latched, or not any more."""
    spec, trace, found, flags = view.spec, view.trace, dict[str, Table](), []
    stepped = view.steps.clock[view.steps.step != 0]
    end = (1 << extra.time_width(spec)) - 1
    for number, line in enumerate(extra.lines):
        at, level = view.steps.pins[line]
        # An edge is known in a register a clock before it is shown; what has been set until then counts.
        known = at[1:] + spec.latency.tick - 1
        wanted = trace.line_at("probe_edges", known - 1, extra.packed_edges) >> 2 * number & (RISING | FALLING)
        edges = known[wanted & np.where(level[1:] > level[:-1], RISING, FALLING) != 0]
        clock, flag = _while_armed(number, edges, trace)
        flags.append(flag)
        last = np.searchsorted(stepped, clock - spec.latency.tick, side="right")
        since = np.where(last > 0, clock - spec.latency.tick - np.append(0, stepped)[last], end)
        columns = {
            f"probe_position_{number}": positions_at(spec, view.steps, clock - spec.latency.tick),
            f"probe_time_{number}": np.minimum(since, end),
        }
        if FINE in (updates := view.tables[spec.whole]).columns:  # the latest before these clocks
            row = np.searchsorted(updates.clock, clock)
            age = np.where(row > 0, clock - np.append(0, updates["cause"])[row], (1 << extra.age_width(spec)) - 1)
            columns |= {f"probe_fine_{number}": np.append(0, updates[FINE])[row], f"probe_age_{number}": age}
        found[f"probe_valid_{number}"] = Table(clock, columns)
    latched = np.unique(np.concatenate([table.clock for table in found.values()]))
    return found | {"probe": Table(latched, {}), "probed": _together(flags)}


def shown(
    extra: Probe, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return `probed`; a program that clears leaves it as it is."""
    probed = found["probed"]["probed"][np.searchsorted(found["probed"].clock, clock, side="right") - 1]
    return {"probed": probed if len(extra.lines) > 1 else probed != 0}


def _while_armed(number: int, edges: Ints, trace: PinTrace) -> tuple[Ints, list[tuple[int, int]]]:
    """Return clocks in which a probe shows what it has latched, and those from which it has latched or has not."""
    arm = trace.lines["probe_arm"] >> np.uint8(number) & np.uint8(1)
    begins = np.flatnonzero(np.diff(arm, prepend=0, append=0))
    spans = np.append(trace.clock, trace.n_clocks)[begins].reshape(-1, 2).tolist()  # armed from, until
    clocks, flags, free, at = list[int](), list[tuple[int, int]](), True, 0
    for edge in edges.tolist():
        while at < len(spans) and spans[at][0] < edge:
            if not free:
                flags.append((spans[at][0] + 1, 0))
            free = True
            if spans[at][1] > edge:
                break
            at += 1
        armed = at < len(spans) and spans[at][0] <= edge < spans[at][1]
        if free:
            clocks.append(edge + 1)
        if free != armed:
            flags.append((edge + 1, int(free)))
        free = armed
    if not free and at < len(spans):
        flags.append((spans[at][0] + 1, 0))
    return np.array(clocks, dtype=np.int64), flags


def _together(flags: list[list[tuple[int, int]]]) -> Table:
    """Return the flags of all probes as one number, from each clock on in which it changes."""
    changes = [(clock, number, flag) for number, each in enumerate(flags) for clock, flag in each]
    clocks, values, value = [0], [0], 0
    for clock, number, flag in sorted(changes):
        value = value & ~(1 << number) | flag << number
        clocks.append(clock)
        values.append(value)
    return Table(np.array(clocks, dtype=np.int64), {"probed": np.array(values, dtype=np.int64)})
