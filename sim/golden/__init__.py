"""Golden models compute exact integers over whole recordings, from the papers and the spec alone."""

from typing import Any

import numpy as np

from tachometry.sim.golden import extras
from tachometry.sim.golden.axes import run_axes
from tachometry.sim.golden.front_end import Steps, count, decoded
from tachometry.sim.golden.low_pass import filtered
from tachometry.sim.golden.methods import MODELS
from tachometry.sim.golden.output import in_unit, with_age, with_whole
from tachometry.sim.golden.sampled import ticks_of, with_presets
from tachometry.sim.golden.sampling import windows
from tachometry.sim.golden.standstill import with_standstill
from tachometry.sim.signals.axes import AxesTrace, Trace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, Table
from tachometry.spec import CoreSpec, TachometerSpec
from tachometry.spec.language.port import MISSED, TICK, WIDE


def model(spec: TachometerSpec) -> Any:
    """Return the golden model of the spec's method."""
    return MODELS[spec.method](spec)


def run(spec: CoreSpec, trace: Trace) -> Run:
    """Return what the core of `spec` must show at its ports for these pins."""
    if spec.axes is not None:
        assert isinstance(trace, AxesTrace), "a core of many axes needs the pins of each"
        return run_axes(spec, trace, tables)
    assert isinstance(trace, PinTrace), "a core of one axis needs the pins of one"
    return Run.of_ports(spec, trace.n_clocks, tables(spec.tachometer, trace))


def tables(spec: TachometerSpec, trace: PinTrace, steps: Steps | None = None) -> dict[str, Table]:
    """Return the same by strobes, and with each update the clock of its cause, as the column `cause`; of other steps
    than those of the trace if they are given.
    """
    steps = decoded(spec, trace) if steps is None else steps
    steps = extras.displaced(extras.View(spec, trace, steps, {}))
    golden = model(spec)
    if spec.facts.own_ticks:
        last, beyond, nominal = golden.windows(steps, trace.n_clocks - spec.latency.tick)
        tick_errors = np.empty(0, dtype=np.int64)
    else:
        last, tick_errors = windows(spec, trace)
        beyond, nominal = None, np.broadcast_to(np.int64(1), last.shape)
    if steps.reads is None:
        ticks, index = count(spec, steps, last, beyond)
    else:
        none = np.empty(0, dtype=np.int64)
        ticks = with_presets(spec, ticks_of(spec, steps.reads, last), steps.presets, steps.values)
        index = Table(none, {"index_position": none})
    del last  # as long as all ticks
    if spec.facts.rests_with == TICK:
        ticks = with_standstill(spec, ticks, nominal)
    measured = golden.updates(ticks, steps, trace.n_clocks)
    if "cause" not in measured.columns:
        measured = measured.having(cause=measured.clock - spec.latency.datapath)
    updates = in_unit(spec, filtered(spec, ticks, measured))
    measured = measured.having(clock=measured.clock + (spec.latency.native_update - spec.latency.datapath))
    without = {"tick": ticks, **with_whole(spec, updates), "index_valid": index, "measured": measured}
    added = extras.tables(extras.View(spec, trace, steps, without))
    ticks = ticks.having(**extras.shown(spec, added, ticks.clock))
    found = without | {
        "tick": with_age(spec, ticks, updates),
        WIDE: Table(steps.wide + spec.latency.tick, {}),
        MISSED: Table(steps.missed + spec.latency.tick, {}),
        "decode_error": Table(steps.errors, {}),
        "tick_error": Table(tick_errors, {}),
        **added,
    }
    return {name: table.rows(slice(np.searchsorted(table.clock, trace.n_clocks))) for name, table in found.items()}
