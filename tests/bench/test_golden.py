"""The benchmark of the golden models measures what it says."""

import numpy as np
import pytest
from support.script import load

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import METHODS

bench = load("golden")


@pytest.fixture
def trace() -> PinTrace:
    encoder = VirtualEncoder(500, seed=1)
    return encoder.record(parse_motion("constant:300rad/s:20ms")).recording.place(48_000_000)


def test_part_of_a_trace_has_the_same_levels(trace: PinTrace) -> None:
    part = bench.part_of(trace, 100_000, 50_000)
    assert part.n_clocks == 50_000
    assert part.clock[0] == 0
    at = np.searchsorted(part.clock, np.arange(50_000), side="right") - 1
    of_all = np.searchsorted(trace.clock, np.arange(100_000, 150_000), side="right") - 1
    assert (part.a[at] == trace.a[of_all]).all()
    assert (part.b[at] == trace.b[of_all]).all()


def test_hardware_that_disagrees_is_no_result(trace: PinTrace, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "BEGIN", 100_000)
    monkeypatch.setattr(bench, "SIMULATED", 3000)
    spec = bench.cores()["s"]
    result = bench.measure("s", spec, trace)
    assert (result.clocks, result.ticks) == (trace.n_clocks, len(golden.run(spec, trace).ticks.clock))
    wrong = bench.cores()["m"]
    monkeypatch.setattr(PySim, "run", lambda *_: golden.run(wrong, bench.part_of(trace, 100_000, 3000)))
    with pytest.raises(RuntimeError, match="disagree"):
        bench.measure("s", spec, trace)


def test_every_method_is_measured() -> None:
    assert set(METHODS) <= set(bench.cores())
