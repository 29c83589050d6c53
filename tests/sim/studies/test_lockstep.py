"""Lockstep may be interrupted; the engine is the golden model itself."""

import numpy as np
import pytest

from tachometry.sim import golden
from tachometry.sim.engines.engine import NO_WATCH, Interrupted, Watch
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import Run
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import CoreSpec, of_texts

SPEC = of_texts("m", {"ppr": "8", "clock": "1MHz", "tick": "10clk", "max-time": "100clk"})
LEVEL = quadrature(np.arange(100))
TRACE = PinTrace(7 * np.arange(100), LEVEL & np.uint8(1), LEVEL >> np.uint8(1), 700)


class Stops:
    """An engine in which Ctrl-C comes after so many clocks, if at all."""

    name = "stops"

    def __init__(self, after: int | None = None) -> None:
        self.after, self.given = after, NO_WATCH

    def run(self, spec: CoreSpec, trace: Trace, watch: Watch = NO_WATCH) -> Run:
        self.given = watch
        if self.after is None:
            return golden.run(spec, trace)
        raise Interrupted(golden.run(spec, trace.until(self.after)))


def test_all_that_was_asked_for() -> None:
    engine = Stops()
    found = lockstep(SPEC, TRACE, engine, watch=Watch(window=(3, 9)))
    assert found.trace is TRACE
    assert found.n_mismatches == 0 == len(found.first)
    assert len(found.actual.ticks) == len(found.expected.ticks) == 69
    assert engine.given == Watch(window=(3, 9))


def test_a_known_run_is_not_computed_again() -> None:
    known = golden.run(SPEC, TRACE.until(350))
    found = lockstep(SPEC, TRACE, Stops(), expected=known)
    assert found.expected is known
    assert found.n_mismatches > 0


@pytest.mark.parametrize("fewest", [0, 1, 399, 400])
def test_what_was_done_until_it_was_interrupted(fewest: int) -> None:
    found = lockstep(SPEC, TRACE, Stops(400), fewest=fewest)
    assert (found.trace.n_clocks, found.actual.n_clocks, found.expected.n_clocks) == (400, 400, 400)
    assert found.n_mismatches == 0
    assert len(found.actual.ticks) == 39


@pytest.mark.parametrize("fewest", [None, 401, 700])
def test_too_little_was_done_until_it_was_interrupted(fewest: int | None) -> None:
    with pytest.raises(Interrupted) as early:
        lockstep(SPEC, TRACE, Stops(400), fewest=fewest)
    assert early.value.run.n_clocks == 400
