"""A core with its control loop in gates, about a motor: what it commands is what the golden models say, bit for bit."""

from dataclasses import replace
from fractions import Fraction

import pytest
from loops import KINDS, REAL, check, setting
from support.compiled import read_exported
from support.nightly import only

from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.engines.loop import Observer
from tachometry.sim.golden.control import Control
from tachometry.sim.studies.loops.control import Load, Task, in_gates, simulation_of
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.option import ParameterError

DOUBLE = replace(
    setting(KINDS[0], 80.0, 20e-6, REAL),
    task=Task(
        motion=parse_motion("ramp:0:15rad/s:100ms+ramp:15rad/s:-5rad/s:150ms+constant:-5rad/s:150ms"),
        load=Load(torque=0.1, begin=0.3, seconds=0.05),
        noise=0.005,
    ),
    begin=0.05,
)
SPEC = LoopSpec(
    tachometer=DOUBLE.spec,
    position_gain=Fraction(1600),
    velocity_gain=Fraction(80),
    observer=Fraction(160),
    current_limit=Fraction(8),
)


def test_the_core_of_a_setting_has_its_gains() -> None:
    assert in_gates(DOUBLE).gates == replace(SPEC, velocity_filter=SPEC.filter, control_period=SPEC.period)
    fast = in_gates(replace(DOUBLE, gains=replace(DOUBLE.gains, seconds=2e-6, way=Observer.CONVENTIONAL))).gates
    assert fast is not None
    assert (fast.period, fast.multiplier, fast.synchronised) == (96, "parallel", False)
    for name, wrong in (("delay", {"delay": 1e-6}), ("unfiltered", {"on_filtered": False})):
        with pytest.raises(ParameterError, match=f"{name} must not be given together with --gates"):
            in_gates(replace(DOUBLE, gains=replace(DOUBLE.gains, **wrong)))
    with pytest.raises(ParameterError, match="observer must be of a size from"):
        in_gates(replace(DOUBLE, gains=replace(DOUBLE.gains, observer=1e-9)))


@pytest.mark.parametrize("exported", only([False], [False, True]))
def test_a_check_counts_what_differs(exported: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    simulation_of.cache_clear()
    if exported:
        read_exported(monkeypatch)
    short = replace(DOUBLE, task=Task(motion=parse_motion("ramp:0:15rad/s:60ms+constant:15rad/s:20ms"), noise=0.005))
    found = check(short, 1)
    assert (found.ticks, found.mismatches) == (3_999, 0)
    assert found.gates.rms == pytest.approx(found.double.rms, rel=0.05)
    monkeypatch.setattr(Control, "update", lambda self, velocity, **more: None)  # no velocity at all
    assert check(short, 1).mismatches > 3_999
