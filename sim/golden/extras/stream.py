"""Golden model of `spec.core.extras.stream`: a record of each event, unless the one before still waits."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden import extras
from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import Steps, homed, positions_at
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.stream import LOST, OVERRUNS_WIDTH, READY, Stream
from tachometry.spec.language.port import TICK

Ints = NDArray[np.int64]


def _events(extra: Stream, spec: TachometerSpec, steps: Steps, tables: Mapping[str, Table]) -> Ints:
    """Return clocks of records, sent or not."""
    if extra.records.when == "edge":
        return steps.clock[steps.step != 0] + spec.latency.tick
    return tables[TICK if extra.records.when == "tick" else spec.whole].clock


def _free(trace: PinTrace, clock: Ints) -> NDArray[np.bool_]:
    """Return which of the events find that the record before is taken, or is being taken."""
    ready = trace.lines[READY] != 0
    found = np.ones(len(clock), dtype=np.bool_)
    if ready.all():
        return found
    row = np.searchsorted(trace.clock, clock + 1, side="right") - 1
    opens = np.append(np.flatnonzero(ready), len(ready))
    opening = opens[np.searchsorted(opens, row)]  # the row in which, or from which on, it is taken
    taken = np.maximum(np.append(trace.clock, np.iinfo(np.int64).max)[opening], clock + 1)
    until = 0
    for place, (comes, goes) in enumerate(zip(clock.tolist(), taken.tolist(), strict=True)):
        found[place] = comes >= until
        until = goes if comes >= until else until
    return found


def tables(extra: Stream, view: View) -> dict[str, Table]:
    """Return the clocks in which records are dropped."""
    clock = _events(extra, view.spec, view.steps, view.tables)
    return {"overruns": Table(clock[~_free(view.trace, clock)], {})}


def shown(
    extra: Stream, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return how many were dropped after `cleared`, and before each clock."""
    dropped = found["overruns"].clock
    number = np.searchsorted(dropped, clock) - np.searchsorted(dropped, cleared, side="right")
    return {"overruns": np.clip(number, 0, (1 << OVERRUNS_WIDTH) - 1)}


def records(
    spec: TachometerSpec, trace: PinTrace, steps: Steps, tables: Mapping[str, Table]
) -> tuple[Ints, NDArray[np.void]]:
    """Return the first clock of each record on the stream, and the records, with the `dtype` of the manifest.

    Fields of updates, but the velocity, are not defined before the first. `tables` are `sim.golden.tables` of `steps`.
    """
    extra = Stream.of(spec.extras)
    assert extra is not None
    entry, clock = extra.entry(spec), _events(extra, spec, steps, tables)
    free = _free(trace, clock)
    rows = {name: np.searchsorted(tables[name].clock, clock, side="right") for name in (TICK, spec.whole)}
    held = {
        name: np.append(np.zeros_like(column[:1]) if len(column) else 0, column)[row]
        for strobe, row in rows.items()
        for name, column in tables[strobe].columns.items()
    }
    shown = Table(clock, held).having(homed=homed(spec, steps, clock), **{LOST: np.append(False, ~free[:-1])})
    shown = shown.having(**extras.shown(spec, tables, clock))
    found = np.zeros(len(clock), dtype=np.dtype(entry["dtype"]))
    bits = [shown[name].astype(np.uint32) << np.uint32(place) for place, name in enumerate(extra.flags(spec))]
    position = positions_at(spec, steps, clock - spec.latency.tick, reset=True)
    values = {"time": clock, "flags": sum(bits), "position": position}
    for name in entry["dtype"]["names"]:
        found[name] = values[name] if name in values else shown[name]
    return clock[free] + 1, found[free]
