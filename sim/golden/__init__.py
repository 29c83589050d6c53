"""Golden models: exact integers over whole recordings, from the papers and the spec alone."""

from tachometry.sim.golden.front_end import count
from tachometry.sim.golden.s_method import SModel
from tachometry.sim.recording import PinTrace
from tachometry.sim.results import Run
from tachometry.spec import TachometerSpec

MODELS = {"s": SModel}


def run(spec: TachometerSpec, trace: PinTrace) -> Run:
    """What the core of `spec` must show at its ports for these pins."""
    ticks, errors = count(spec, trace.clock, trace.a, trace.b, trace.n_clocks)
    model = MODELS[spec.method](spec)  # type: ignore[arg-type]
    return Run(trace.n_clocks, ticks, model.updates(ticks, trace.n_clocks), errors)
