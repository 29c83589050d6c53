"""The benchmark of the engines measures what it says."""

import numpy as np
import pytest
from support.script import load

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Encoder, MTachometer, Timing

bench = load("engines")
# The smallest core, since each test compiles it several times.
SPEC = MTachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"))


@pytest.fixture
def trace(monkeypatch: pytest.MonkeyPatch) -> PinTrace:
    monkeypatch.setattr(bench, "BEGIN", 100_000)
    return VirtualEncoder(500).record(parse_motion("constant:300rad/s:20ms")).recording.place(48_000_000)


def test_part_of_a_trace_has_the_same_levels(trace: PinTrace) -> None:
    part = trace.part(100_000, 150_000)
    assert part.n_clocks == 50_000
    assert part.clock[0] == 0
    at = np.searchsorted(part.clock, np.arange(50_000), side="right") - 1
    of_all = np.searchsorted(trace.clock, np.arange(100_000, 150_000), side="right") - 1
    assert (part.a[at] == trace.a[of_all]).all()
    assert (part.b[at] == trace.b[of_all]).all()


def test_hardware_that_disagrees_is_no_result(trace: PinTrace, monkeypatch: pytest.MonkeyPatch) -> None:
    name, *cells = bench.golden_row("m", SPEC, trace, slow=3000)
    assert name == "m"
    assert len(cells) == len(bench.GOLDEN_COLUMNS) - 2
    monkeypatch.setattr(PySim, "run", lambda *_: golden.run(bench.CORES["s"], trace.part(100_000, 103_000)))
    with pytest.raises(RuntimeError, match="disagree"):
        bench.golden_row("m", SPEC, trace, slow=3000)
