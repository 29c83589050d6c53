"""Events say what random motions may cover, and what a run of them has."""

import itertools
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.methods.s import alterations
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.spec import MTachometer, RairanTachometer, STachometer, TachometerSpec, TrackTachometer
from tachometry.spec.formats.tracking_units import BLOCK
from tachometry.spec.methods.timed import TimedTachometer

STATES = ("00", "10", "11", "01")
LEGAL = [f"{STATES[k]}->{STATES[(k + d) % 4]}" for k in range(4) for d in (1, -1)]
ILLEGAL = [f"{STATES[k]}->{STATES[(k + 2) % 4]}" for k in range(4)]
COMMON = [
    "m_e saturated",
    "sign change",
    "standstill",
    "count after standstill",
    "position wrapped",
    "glitch swallowed",
    "index captured",
    "position reset",
    "external tick",
    "external tick too early",
    "external tick missing",
    "velocity saturated",
    "bounds",
    "aged",
    "filtered",
    "waited for the filter",
    *LEGAL,
    *ILLEGAL,
]
TIMED = [
    "times in clocks",
    "times in ticks",
    "paper exact",
    "reversal",
    "count after a silence",
    "count at the maximum time",
    "one after the other",
    "forced after the maximum time",
    "forced again",
    "decay",
    "decay backward",
    "decay again",
    "out of range",
    "speed beyond the maximum",
]
EVENTS = {
    "s": [
        "suppressed return",
        "alteration at max_ticks",
        "forced, then alteration",
        "m_s = 1",
        "reciprocal carried",
        "update in every clock",
        *COMMON,
    ],
    "m": ["one tick", "a power of two", "another number", "update in every clock", *COMMON],
    "mt": ["longer than the maximum time", *(event for event in [*TIMED, *COMMON] if event != "out of range")],
    "t": [*TIMED, *COMMON],
    "track": [
        "serial product",
        "multiplier of the FPGA",
        "bounded memory",
        "several counts",
        "counts that cancel",
        "rest",
        "first count",
        "speed that falls",
        "greatest speed",
        "tick as early as may be",
        *(event for event in COMMON if event not in ("bounds", "waited for the filter")),
    ],
    "rairan": [
        "low",
        "high",
        "reversal",
        "speed that fell",
        "rest",
        "count after rest",
        "dt longer than nominal",
        "to the letter",
        "dt longer",
        "dt shorter again",
        "n1",
        "n2",
        "n3",
        "update in every clock",
        *(event for event in COMMON if "external" not in event),
    ],
}


def _count(found: NDArray[Any]) -> int:
    return int(np.count_nonzero(found))


def covered_by_method(spec: TachometerSpec, run: Run) -> dict[str, int]:
    """Return how often each event that only the method knows happened."""
    m_e, updates = run.ticks.pulse_count, run.updates
    if isinstance(spec, MTachometer):
        n = spec.average
        kind = "one tick" if n == 1 else "a power of two" if spec.form.shift is not None else "another number"
        return {kind: len(updates.clock)}
    if isinstance(spec, RairanTachometer):
        rows, rest = len(updates.clock), updates.forced & (updates["n_ep1"] == 0)
        shift = updates.get("dt_shift")
        return {
            "low": _count(updates.interval > 1),
            "high": _count(updates["n_ep1"] > 1),
            "reversal": _count((updates["n_ep1"] == 0) & ~rest),
            "speed that fell": _count(updates.forced & ~rest),
            "rest": _count(rest),
            "count after rest": _count(rest[:-1] & (updates["n_ep1"][1:] == 1)),
            "dt longer than nominal": _count(np.diff(run.ticks.clock) > spec.timing.tick_cycles),
            "to the letter": rows * spec.paper_exact,
            "dt longer": _count(shift),
            "dt shorter again": _count(np.diff(shift) < 0),
            spec.estimate: rows,
        }
    if isinstance(spec, TimedTachometer):
        return covered_by_timed(spec, run)
    if isinstance(spec, TrackTachometer):
        return covered_by_track(spec, run)
    assert isinstance(spec, STachometer)
    changed = np.diff(m_e, prepend=0) != 0
    by_count = ~updates.forced
    return {
        "suppressed return": _count(changed & ~alterations(m_e)),
        "alteration at max_ticks": _count(by_count & (updates.interval == spec.timing.max_ticks)),
        "forced, then alteration": _count(updates.forced[:-1] & by_count[1:]),
        "m_s = 1": _count(updates.interval == 1),
        "reciprocal carried": spec.form.carried and len(updates.clock),
    }


def covered_by_track(spec: TrackTachometer, run: Run) -> dict[str, int]:
    """Return the same for the tracking method."""
    m_e, updates = run.ticks.pulse_count, run.updates
    n = len(updates.clock)
    rest = updates.forced & (updates.interval == spec.timing.max_ticks)
    return {
        "serial product": n * (spec.program.times != BLOCK),
        "multiplier of the FPGA": n * (spec.program.times == BLOCK),
        "bounded memory": n * (spec.max_memory is not None),
        "several counts": _count(np.abs(m_e) > 1),
        "counts that cancel": _count(~updates.forced & (m_e[:n] == 0)),
        "rest": _count(rest),
        "first count": _count(rest[:-1] & ~updates.forced[1:]),
        "speed that falls": _count(updates.forced[1:] & (np.abs(np.diff(updates.velocity)) > 1)),
        "greatest speed": _count(np.abs(updates.velocity) == spec.velocity.full_scale),
        "tick as early as may be": _count(np.diff(run.ticks.clock) == spec.times.min_tick_cycles),
    }


def covered_by_timed(spec: TimedTachometer, run: Run) -> dict[str, int]:
    """Return the same for the methods that measure times."""
    updates, n = run.updates, len(run.updates.clock)
    velocity, forced, interval = updates.velocity, updates.forced, updates.interval
    decay = (
        forced & (interval < spec.form.max_periods) & (velocity != 0)
        if spec.form.decays
        else np.zeros(n, dtype=np.bool_)
    )
    overdue = forced & ~decay
    flagged = updates.get("out_of_range")
    return {
        "times in ticks" if spec.form.on_lattice else "times in clocks": n,
        "paper exact": n * spec.paper_exact,
        "reversal": _count(~forced & (velocity == 0)),
        "longer than the maximum time": _count(
            np.abs(velocity) * interval > spec.form.timer_periods << spec.velocity.native_frac_bits + 1
        ),
        "count after a silence": _count(overdue[:-1] & ~forced[1:]),
        "count at the maximum time": _count(~forced & (interval == spec.form.max_periods)),
        "one after the other": _count(np.diff(updates.clock) == spec.times.update_spacing),
        "forced after the maximum time": _count(overdue),
        "forced again": _count(overdue[1:] & overdue[:-1]),
        "decay": _count(decay),
        "decay backward": _count(decay & (velocity < 0)),
        "decay again": _count(decay[1:] & decay[:-1]),
        "out of range": _count(flagged) * spec.form.on_lattice,
        "speed beyond the maximum": _count(flagged) * (not spec.form.on_lattice),
    }


def covered(spec: TachometerSpec, trace: PinTrace, run: Run) -> Counter[str]:
    """Return how often each event of the coverage table happened."""
    updates, standstill = run.updates, run.tables[spec.facts.rests_with].standstill
    sign = np.sign(updates.velocity)
    found = Counter(
        covered_by_method(spec, run)
        | {
            "m_e saturated": _count(run.ticks.overflow),
            "sign change": _count(np.diff(sign[sign != 0])),
            "standstill": _count(standstill),
            "count after standstill": _count(np.diff(standstill.astype(np.int64)) < 0),
            "index captured": len(run.index.clock),
            "position reset": len(run.index.clock) * spec.front_end.index_resets,
            "external tick": len(run.ticks.clock) * spec.external_tick,
            "external tick too early": _count(~np.isin(run.tick_errors, run.ticks.clock)),
            "external tick missing": _count(np.isin(run.tick_errors, run.ticks.clock)),
            "velocity saturated": _count(updates.get("velocity_overflow")),
            "filtered": len(updates.clock) * (spec.lowpass is not None),
            "waited for the filter": spec.lowpass is not None
            and _count(np.diff(updates.clock) == spec.velocity.low_pass.latency - 2),
            "bounds": _count(updates.get("bounds_valid")),
            "aged": _count(run.ticks.get("age")),
            "update in every clock": _count(np.diff(updates.clock) == 1),
            "glitch swallowed": int(run.ticks.get("filtered_edges")[-1]) // 2,
            "position wrapped": _count(np.abs(np.diff(run.ticks.position)) >> (spec.position_width - 1)),
        }
    )
    lines = [f"{a}{b}" for a, b in zip(trace.a, trace.b, strict=True)]
    found.update(f"{before}->{after}" for before, after in itertools.pairwise(lines))
    return found
