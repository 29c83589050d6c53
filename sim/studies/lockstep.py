"""Hardware and golden model on the same pins: the one place where they are run side by side and compared."""

from dataclasses import dataclass

from tachometry.sim import golden
from tachometry.sim.engines.engine import NO_WATCH, Engine, Interrupted, Watch
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.run import Mismatch, Run, compare
from tachometry.spec import CoreSpec


@dataclass(frozen=True)
class Lockstep:
    """Holds both runs of a trace, and their differences."""

    trace: Trace  # what was played; after Ctrl-C shorter than what was asked for
    # expected and actual: of the golden model and of the engine
    expected: Run
    actual: Run
    n_mismatches: int  # values that differ
    first: list[Mismatch]  # the first of them in each signal that differs


def lockstep(
    spec: CoreSpec,
    trace: Trace,
    engine: Engine,
    *,
    expected: Run | None = None,
    watch: Watch = NO_WATCH,
    fewest: int | None = None,
) -> Lockstep:
    """Run a trace on the golden model and on an engine, and compare every bit of every row.

    - `expected`: What the golden model makes of the trace, if that is known already.
    - `fewest`: Ctrl-C after this many clocks gives what has been done by then; None: it always ends the run.

    It raises Interrupted at Ctrl-C before that.
    """
    if expected is None:
        expected = golden.run(spec, trace)
    try:
        actual = engine.run(spec, trace, watch)
    except Interrupted as early:
        if fewest is None or early.run.n_clocks < fewest:
            raise
        actual, trace = early.run, trace.until(early.run.n_clocks)
        expected = golden.run(spec, trace)
    return Lockstep(trace, expected, actual, *compare(expected, actual))
