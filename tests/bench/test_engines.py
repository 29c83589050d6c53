"""The benchmark of the engines measures what it says."""

import pytest
from support.nightly import nightly
from support.script import load

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Encoder, MTachometer, Timing

bench = load("engines")
# The smallest core, since each test compiles it several times.
SPEC = MTachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"))


@pytest.fixture
def trace(monkeypatch: pytest.MonkeyPatch) -> PinTrace:
    monkeypatch.setattr(bench, "BEGIN", 100_000)
    return VirtualEncoder(500).record(parse_motion("constant:300rad/s:20ms")).recording.place(48_000_000)


# It compiles a core four times; what it measures is held against the golden models in tests/sim/engines.
@nightly
def test_all_engines_and_the_bare_loop_see_the_same(trace: PinTrace) -> None:
    speed = bench.speed("m", SPEC, trace, slow=3000, fast=100_000)
    assert min(speed.pysim, speed.verilator, speed.bare, speed.every_clock, speed.cxxrtl) > 0
    assert len(speed.cells) == len(bench.SPEED_COLUMNS)


@nightly  # for the same reason
def test_every_step_sees_the_same(trace: PinTrace) -> None:
    assert len(bench.steps(SPEC, trace, n_clocks=100_000)) == 7
