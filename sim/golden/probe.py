"""The golden probes latch the position at edges of their inputs, while they are armed."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps, positions_at
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.probe import FALLING, RISING, packed_edges
from tachometry.spec.language.port import FINE

Ints = NDArray[np.int64]


def latched(spec: TachometerSpec, steps: Steps, trace: PinTrace, updates: Table) -> dict[str, Table]:
    """Return what each probe latches, by strobes, and as `probed` when one of them has latched, or not any more."""
    found, flags = {}, []
    for number, (seen, level) in enumerate(steps.probes):
        # An edge is known in a register a clock before it is shown; what has been set until then counts.
        known = seen[1:] + spec.latency.tick - 1
        rows = np.searchsorted(trace.clock, known - 1, side="right") - 1
        packed = packed_edges(spec.probe) if "probe_edges" not in trace.more else trace.more["probe_edges"][rows]
        wanted = packed >> 2 * number & (RISING | FALLING)
        edges = known[wanted & np.where(level[1:] > level[:-1], RISING, FALLING) != 0]
        clock, flag = _while_armed(number, edges, trace)
        flags.append(flag)
        stepped = steps.clock[steps.step != 0]
        last = np.searchsorted(stepped, clock - spec.latency.tick, side="right")
        end = (1 << spec.times.probe_width) - 1
        since = np.where(last > 0, clock - spec.latency.tick - np.append(0, stepped)[last], end)
        found[f"probe_valid_{number}"] = Table(
            clock,
            {
                f"probe_position_{number}": positions_at(spec, steps, clock - spec.latency.tick),
                f"probe_time_{number}": np.minimum(since, end),
                **_fine(spec, number, clock, updates),
            },
        )
    return found | {"probed": _together(flags)} if spec.probe else {}


def _fine(spec: TachometerSpec, number: int, clock: Ints, updates: Table) -> dict[str, Ints]:
    """Return the fine position of the latest update before these clocks, and its age, if there is one."""
    if FINE not in updates.columns:
        return {}
    row = np.searchsorted(updates.clock, clock)
    fine, cause = np.append(0, updates[FINE])[row], np.append(0, updates["cause"])[row]
    age = np.where(row > 0, clock - cause, (1 << spec.times.probe_age_width) - 1)
    return {f"probe_fine_{number}": fine, f"probe_age_{number}": age}


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


def shown(found: Table, clock: Ints) -> NDArray[Any]:
    """Return `probed` in these clocks."""
    value: NDArray[Any] = found["probed"][np.searchsorted(found.clock, clock, side="right") - 1]
    return value


def with_probed(spec: TachometerSpec, ticks: Table, found: dict[str, Table]) -> Table:
    """Return ticks with the probes that have latched."""
    if not spec.probe:
        return ticks
    probed = shown(found["probed"], ticks.clock)
    return ticks.having(probed=probed if len(spec.front_end.probes) > 1 else probed != 0)
