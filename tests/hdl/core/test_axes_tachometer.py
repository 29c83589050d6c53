"""The whole core for many axes against its golden model, and what each of its boxes could do wrong."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.axes import TICK_CYCLES, check, motions, small
from support.simulate import Resettable, clock_by_clock
from support.verilog import run_in_icarus

from tachometry.hdl.core.axes_tachometer import AxesTachometer
from tachometry.sim import golden
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import AxesSpec, Encoder, ParameterError, Speed, Timing, TrackTachometer
from tachometry.spec.core.index import Index
from tachometry.spec.methods.track_axis import TrackAxis

SPECS = {
    "three axes": small(),
    "one axis": small(1, index=Index(), cancel=False),
    "two held": small(2, parallel=True, index=Index()),
    "no greatest speed": small(3, most=None, position_width=8),
    "rpm, and an index that resets": small(3, unit="rpm", index=Index(reset=True), tick=60),
    "few bits": small(2, most=None, velocity_width=9, parallel=True),
    "filter": small(3, filter_clocks=5, index=Index()),
    "ticks from outside, held": small(2, external_tick=True, filter_clocks=1, parallel=True),
    "all": small(3, external_tick=True, tick=60, unit="rad/s", index=Index(reset=True)),
}


@pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)
def test_small_cores(spec: AxesSpec) -> None:
    check(spec)


def test_an_edge_is_in_the_tick_that_ends_pin_to_count_after_it() -> None:
    """Of every axis; one that is sampled a clock later is too late for axis 0, which is looked at first."""
    spec = small()

    def counted(clock: int) -> list[int]:
        """Return pulse numbers of all axes in the second tick, of edges in a clock."""
        low = np.zeros(2, dtype=np.uint8)
        pins = PinTrace(np.array([0, clock]), a=np.array([0, 1], dtype=np.uint8), b=low, n_clocks=4 * TICK_CYCLES)
        run = golden.run(spec, AxesTrace((pins,) * spec.axes))
        found: list[int] = run.ticks.pulse_count[spec.axes : 2 * spec.axes].tolist()
        return found

    last = 2 * TICK_CYCLES - 1 - spec.latency.pin_to_count
    assert counted(last) == [1] * spec.axes
    assert counted(last + 1)[0] == 0


def test_a_run_that_ends_earlier_has_the_same_rows_until_then() -> None:
    """Wherever it ends."""
    spec = small(2, index=Index())
    trace = motions(spec, 400)
    whole = golden.run(spec, trace)
    for n_clocks in range(300, 400):
        short = golden.run(spec, trace.until(n_clocks))
        for strobe, table in whole.tables.items():
            before = table.rows(table.clock < n_clocks)
            found = short.tables[strobe]
            assert found.clock.tolist() == before.clock.tolist()
            for name in table.columns:
                assert found[name].tolist() == before[name].tolist(), (strobe, name)


def test_a_reset_clears_what_is_in_memory() -> None:
    """The content of the memories at a reset does not matter."""
    spec = small(2, index=Index())
    trace, names = motions(spec, 900), [port.name for port in spec.ports.outputs]
    rows: list[dict[str, int]] = [{} for _ in range(trace.n_clocks)]
    for clock, *levels in zip(trace.clock.tolist(), *(line.tolist() for line in trace.lines.values()), strict=True):
        rows[clock] = dict(zip(trace.lines, levels, strict=True))
    rows[0]["rst"] = 0
    # As long before the reset as after it, on other levels.
    before = [{**row, **({"a": row["b"], "b": row["a"]} if "a" in row else {})} for row in rows[:701]]
    seen = clock_by_clock(Resettable(AxesTachometer(spec)), [*before, {"rst": 1}, *rows], names)
    fresh = clock_by_clock(Resettable(AxesTachometer(spec)), rows, names)
    strobes = {port.name: port.held_by for port in spec.ports.outputs}
    for clock, (after, wanted) in enumerate(zip(seen[702:], fresh, strict=True)):
        for name, strobe in strobes.items():
            assert not wanted[strobe] or after[name] == wanted[name], (clock, name)
            assert name != strobe or after[name] == wanted[name], (clock, name)


def test_all_ticks_come_in_step() -> None:
    """Latencies are those of the manifest: `first_tick`, `turn_cycles`, and a tick later the same again."""
    spec = small(3)
    ticks = golden.run(spec, motions(spec, 400)).ticks
    first, turn = spec.tick_clock(0, 0), spec.turn_cycles
    wanted = [first + turn * axis + TICK_CYCLES * tick for tick in range(12) for axis in range(3)]
    assert ticks.clock.tolist() == wanted[: len(ticks)]
    assert ticks["axis"].tolist() == [0, 1, 2] * (len(ticks) // 3)
    assert spec.latency.tick == first + 2 * turn - (TICK_CYCLES - 1)


# Many axes with the tracking method against the golden model of one axis.
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
