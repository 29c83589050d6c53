"""The bounds of the methods that measure times, in gates: to the bit those of the golden model."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from support.simulate import clock_by_clock
from support.timed import OUTPUTS, TICK, spec_of

from tachometry.hdl.methods import DATAPATHS
from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.signals.run import Table
from tachometry.spec import Timing
from tachometry.spec.core.ports import BOUNDS

CLOCKS = 2400
NAMES = [*OUTPUTS[1:], *BOUNDS, "bounds_valid"]


def counts(seed: int) -> NDArray[np.int64]:
    """Return a step for every clock: steady and fast, in either direction, over one edge, and silence up to three
    times.
    """
    rng = np.random.default_rng(seed)
    step = np.zeros(CLOCKS, np.int64)
    at, way = 100, 1
    while at < CLOCKS:
        gap, turns = [(1, 0.2), (3, 0.5), (9, 0.1), (23, 0), (41, 0.3), (60, 0.2)][rng.integers(6)]
        for _ in range(rng.integers(1, 8)):
            if at < CLOCKS:
                way *= -1 if rng.random() < turns else 1
                step[at] = way
            at += gap + int(rng.integers(2))
        at += int(rng.integers(250)) * (rng.random() < 0.3)
    return step


def check(method: str, timer: str, seed: int = 1) -> None:
    """All updates of a run, with their bounds."""
    spec = replace(spec_of(method, timer=timer, bounds=True), timing=Timing(100 * TICK, TICK, 4))
    step = counts(seed)
    tick = np.arange(TICK - 1, CLOCKS, TICK)
    m_e = step.reshape(-1, TICK).sum(axis=1)
    none = np.empty(0, np.int64)
    at = np.flatnonzero(step)
    n_clocks = CLOCKS + spec.latency.datapath
    steps = Steps(at - spec.latency.tick, step[at], none, none, none)
    golden = model(spec).updates(Table(tick, {"pulse_count": m_e}), steps, n_clocks)
    golden = golden.rows(golden.clock < n_clocks)
    rows = []
    for clock in range(n_clocks):
        row = {"coming": int(clock < CLOCKS and clock % TICK == TICK - 2)}
        if spec.form.on_lattice:
            window = min(clock, CLOCKS - 1) // TICK
            row |= {"next_count": int(m_e[window]), "pulse_count": int(m_e[window])}
        else:
            row["step_before"] = int(step[clock + 1]) if clock + 1 < CLOCKS else 0
        rows.append(row)
    datapath = DATAPATHS[spec.method](spec)
    seen = clock_by_clock(datapath, rows, ["velocity_valid", *NAMES])
    got = [[clock, *(row[name] for name in NAMES)] for clock, row in enumerate(seen) if row["velocity_valid"]]
    held = {"clock": golden.clock, **golden.columns}
    wanted = np.stack([held[name].astype(np.int64) for name in ("clock", *NAMES)], axis=1)
    assert len(wanted) > 20
    assert len(np.unique(held["bounds_valid"])) == 2
    assert got == wanted.tolist()


KINDS = [("t", "clock"), ("t", "tick"), ("mt", "clock"), ("mt", "tick")]


@pytest.mark.parametrize(("method", "timer"), KINDS)
def test_bounds(method: str, timer: str) -> None:
    check(method, timer)
