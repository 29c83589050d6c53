"""Golden models: exact integers over whole recordings, from the papers and the spec alone."""

from typing import Any

from tachometry.sim.golden.front_end import count
from tachometry.sim.golden.s_method import SModel
from tachometry.sim.recording import PinTrace
from tachometry.sim.results import Run
from tachometry.spec import TachometerSpec

MODELS: dict[str, Any] = {"s": SModel}


def run(spec: TachometerSpec, trace: PinTrace) -> Run:
    """What the core of `spec` must show at its ports for these pins."""
    ticks, errors = count(spec, trace.clock, trace.a, trace.b, trace.n_clocks)
    updates = MODELS[spec.method](spec).updates(ticks, trace.n_clocks)
    return Run(trace.n_clocks, ticks, updates, errors)
