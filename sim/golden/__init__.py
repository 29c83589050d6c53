"""Golden models: exact integers over whole recordings, from the papers and the spec alone."""

from typing import Any

from tachometry.sim.golden.front_end import count
from tachometry.sim.golden.output import in_unit
from tachometry.sim.golden.s_method import SModel
from tachometry.sim.golden.sampling import windows
from tachometry.sim.recording import PinTrace
from tachometry.sim.results import Run
from tachometry.spec import TachometerSpec

MODELS: dict[str, Any] = {"s": SModel}


def run(spec: TachometerSpec, trace: PinTrace) -> Run:
    """What the core of `spec` must show at its ports for these pins."""
    last, tick_errors = windows(spec, trace)
    ticks, index, errors = count(spec, trace, last)
    updates = MODELS[spec.method](spec).updates(ticks, trace.n_clocks)
    return Run(trace.n_clocks, ticks, in_unit(spec, updates), index, errors, tick_errors)
