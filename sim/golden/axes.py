"""The golden model of many axes takes each as a core of its own, on what it sees of its pins."""

from collections.abc import Callable

import numpy as np

from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import TachometerSpec
from tachometry.spec.language.port import INDEX, TICK, UPDATE
from tachometry.spec.methods.axes import COUNT_LATENCY, AxesSpec


def run_axes(spec: AxesSpec, trace: AxesTrace, tables: Callable[[TachometerSpec, PinTrace], dict[str, Table]]) -> Run:
    """Return what the core of `spec` must show at its ports for these pins; `tables` is the golden model of a single
    core.
    """
    found: dict[str, list[Table]] = {name: [] for name in spec.axis.ports.strobes}
    for axis, pins in enumerate(trace.each):
        rows = tables(spec.axis, seen(spec, pins, axis))
        ticks, updates = rows[TICK], rows[UPDATE]
        number = (updates["cause"] - ticks.clock[0]) // spec.rounds
        clocks = {
            TICK: spec.tick_clock(axis, np.arange(len(ticks))),
            UPDATE: spec.tick_clock(axis, number),
            "decode_error": spec.look(axis, rows["decode_error"].clock) + COUNT_LATENCY,
            INDEX: spec.look(axis, rows[INDEX].clock - spec.axis.latency.tick) + spec.latency.index,
        }
        for name, tables_of_name in found.items():
            own = {"clock": clocks[name], "axis": np.full(len(rows[name]), axis)}
            tables_of_name.append(rows[name].having(**own))
    every = {name: _merged(each, trace.n_clocks) for name, each in found.items()}
    if spec.parallel:
        every = {name: _held(table, spec.axis.ports.strobes[name], spec.axes) for name, table in every.items()}
    named = {
        name: table.having(**{f"{name.removesuffix('_valid')}_axis": table["axis"]}) for name, table in every.items()
    }
    return Run.of_ports(spec, trace.n_clocks, named)


def seen(spec: AxesSpec, pins: PinTrace, axis: int) -> PinTrace:
    """Return what an axis sees of its pins, on the clock of `spec.axis`: the levels at its looks.

    The first level that counts is looked at in the third round; a core of its own has its first in the third clock.
    """
    core = spec.axis
    first = spec.look(axis, core.latency.pin_to_count) - core.latency.pin_to_count
    look = np.maximum(-(-(pins.clock - first) // spec.slots), 0)
    last = np.append(look[1:] != look[:-1], True)  # of the levels between two looks
    lines = {name: line[last] for name, line in pins.lines.items()}
    # So long that all that is shown within the trace has come.
    n_clocks = pins.n_clocks // spec.slots + core.latency.datapath + 2 * spec.rounds
    return PinTrace(look[last], n_clocks=n_clocks, **lines)


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
