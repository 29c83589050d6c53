"""Many axes with the tracking method against the golden model of one axis."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from support.axes import motions
from support.verilog import run_in_icarus

from tachometry.sim import golden
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import AxesSpec, Encoder, ParameterError, Speed, Timing, TrackTachometer
from tachometry.spec.core.index import Index
from tachometry.spec.methods.track_axis import TrackAxis


def spec_of(axes: int, tick: int, max_ticks: int = 8, *, parallel: bool = False, **options: Any) -> AxesSpec:
    timing = Timing(48_000_000, tick, max_ticks)
    alone = TrackTachometer(encoder=Encoder(500), timing=timing, max_speed=Speed.parse("3000rad/s"), **options)
    return AxesSpec(tachometer=alone, axes=axes, parallel=parallel)


def test_gates_and_golden_model_agree() -> None:
    """Of three axes on two machines, one of which has two in turn; a unit, an index that resets, a filter."""
    spec = spec_of(3, 640, 2, unit="rpm", index=Index(reset=True), filter_clocks=3)
    assert spec.plan.machines == 2
    trace = motions(spec, 12 * 640)
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0, found.first
    updates = found.expected.updates
    assert len(updates) > 30
    assert len(set(updates.velocity.tolist())) > 5
    assert len(found.expected.tables["index_valid"]) > 0


def test_the_exported_verilog_agrees_with_the_golden_model(tmp_path: Path) -> None:
    """One machine has four axes in turn, each of which has a velocity."""
    spec = spec_of(4, 1920)
    assert spec.plan.machines == 1
    trace = motions(spec, 12 * 1920)
    actual = run_in_icarus(spec, tmp_path, trace)
    count, first = compare(golden.run(spec, trace), actual)
    assert count == 0, first
    assert actual.updates.velocity.reshape(-1, 4).any(axis=0).all()


def test_each_axis_is_ahead_by_its_place_in_the_turn() -> None:
    """The velocity is that of the clock in which it is shown, a turn later for the next axis."""
    spec = spec_of(2, 1920)
    turn = spec.plan.cycles
    assert spec.delay(1) == spec.delay(0) + turn - 1
    for axis in range(2):
        own = spec.at(axis)
        assert isinstance(own, TrackAxis)
        assert own.program.ahead == own.latency.pin_to_count + round(spec.delay(axis) / spec.slots)


@pytest.mark.parametrize(("axes", "tick"), [(1, 960), (8, 1920), (32, 4800), (64, 9600), (64, 960)])
def test_there_are_as_many_machines_as_the_turns_of_a_tick_need(axes: int, tick: int) -> None:
    plan = spec_of(axes, tick).plan
    clocks = [plan.start(axis) for axis in range(axes)]
    assert clocks == sorted(set(clocks))
    assert max(clocks) + plan.cycles <= plan.end <= tick - axes
    fewer = replace(plan, machines=max(plan.machines - 1, 1))
    assert plan.machines == 1 or fewer.end > tick - 64


def test_a_tick_that_is_too_short_is_told_with_one_that_is_not() -> None:
    pattern = "^tick_cycles must be a multiple of a number from 32 to 64, .*, not 4801: try --tick 0.1ms or 4802clk"
    with pytest.raises(ParameterError, match=pattern):
        spec_of(32, 4801)
