"""The golden model of many axes takes each as a core of its own, on what it sees of its pins."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace, merged
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.latency import TICK_IN_TO_WINDOW_END
from tachometry.spec.language.port import INDEX, TICK, UPDATE
from tachometry.spec.methods.axes import AxesSpec
from tachometry.spec.methods.axis import WARM_UP


def run_axes(spec: AxesSpec, trace: AxesTrace, tables: Callable[[TachometerSpec, PinTrace], dict[str, Table]]) -> Run:
    """Return what the core of `spec` must show for these pins; `tables` is the golden model of a single core."""
    found: dict[str, list[Table]] = {name: [] for name in spec.axis.ports.strobes}
    for axis, pins in enumerate(trace.each):
        rows = tables(spec.at(axis), seen(spec, pins, axis))
        ticks, updates = rows[TICK], rows[UPDATE]
        latency = spec.axis.latency.tick
        clocks = {
            TICK: spec.shown(axis, ticks.clock - latency),
            UPDATE: spec.shown(axis, updates["cause"] - latency),
            "decode_error": spec.look(axis, rows["decode_error"].clock) + spec.count_latency,
            INDEX: spec.look(axis, rows[INDEX].clock - latency) + spec.latency.index,
            "tick_error": spec.look(0, rows["tick_error"].clock - latency + 2),
        }
        for name, tables_of_name in found.items():
            if name == "tick_error" and axis:
                continue  # it is of all axes
            own = {"clock": clocks[name], "axis": np.full(len(rows[name]), axis)}
            tables_of_name.append(rows[name].having(**own))
    every = {name: _merged(each, trace.n_clocks) for name, each in found.items()}
    if spec.parallel:
        strobes = spec.axis.ports.strobes
        every = {
            name: _held(table, strobes[name], spec.axes) if strobes[name] else table for name, table in every.items()
        }
    named = {
        name: table.having(**{f"{name.removesuffix('_valid')}_axis": table["axis"]}) for name, table in every.items()
    }
    return Run.of_ports(spec, trace.n_clocks, named)


def seen(spec: AxesSpec, pins: PinTrace, axis: int) -> PinTrace:
    """Return what an axis sees of its pins, on the clock of `spec.axis`: the levels at its looks.

    The first level that counts is looked at in the third round; a core of its own has its first in the third clock.
    """
    core = spec.axis
    first = spec.look(axis, WARM_UP - 1) - (WARM_UP - 1)
    look = np.maximum(-(-(pins.clock - first) // spec.slots), 0)
    last = np.append(look[1:] != look[:-1], True)  # of the levels between two looks
    lines = {name: line[last] for name, line in pins.lines.items()}
    # So long that all that is shown within the trace has come.
    n_clocks = pins.n_clocks // spec.slots + core.latency.tick_to_velocity + 2 * spec.rounds
    at = look[last]
    if pins.tick_in is not None:
        clock, level = _ticks(spec, pins)
        merged_clock = merged(at, clock)
        lines = {name: line[np.searchsorted(at, merged_clock, side="right") - 1] for name, line in lines.items()}
        lines["tick_in"] = level[np.searchsorted(clock, merged_clock, side="right") - 1]
        at = merged_clock
    return PinTrace.of_lines(at, n_clocks, lines)


def _ticks(spec: AxesSpec, pins: PinTrace) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return clocks and levels of the external tick for an axis: a round is high if the line was high in any clock."""
    assert pins.tick_in is not None
    until = np.append(pins.clock[1:], pins.n_clocks)
    high = pins.tick_in == 1
    begin, end = ((clock[high] + TICK_IN_TO_WINDOW_END) // spec.slots - 1 for clock in (pins.clock, until - 1))
    change = np.zeros(pins.n_clocks // spec.slots + 4, dtype=np.int64)
    np.add.at(change, np.maximum(begin, 0), 1)
    np.add.at(change, np.maximum(end + 1, 0), -1)
    return np.arange(len(change)), (np.cumsum(change) > 0).astype(np.uint8)


def _merged(tables: list[Table], n_clocks: int) -> Table:
    """Return the rows of all axes in the order of their clocks, no two of which are the same."""
    clock = np.concatenate([table.clock for table in tables])
    order = np.argsort(clock, kind="stable")
    columns = {name: np.concatenate([table[name] for table in tables])[order] for name in tables[0].columns}
    whole = Table(clock[order], columns)
    return whole.rows(whole.clock < n_clocks)


def _held(table: Table, names: tuple[str, ...], axes: int) -> Table:
    """Return the table with a column for each value and axis, which has the latest; at first 0."""
    columns = {}
    for axis in range(axes):
        own = np.flatnonzero(table["axis"] == axis)
        latest = np.searchsorted(own, np.arange(len(table)), side="right")
        for name in names:
            values = table[name][own]
            columns[f"{name}_{axis}"] = np.append(np.zeros(1, dtype=values.dtype), values)[latest]
    return table.having(**columns)
