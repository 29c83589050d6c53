"""The whole core: latencies of the manifest, hand-over, reset, position."""

import itertools
from typing import Any

import numpy as np
import pytest
from amaranth import Module, ResetInserter, Signal
from amaranth.lib.wiring import Component, In, Out
from amaranth.sim import Simulator
from support.nightly import only

from tachometry.hdl import Tachometer
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import Encoder, STachometer, Timing

QUARTERS = [(0, 0), (1, 0), (1, 1), (0, 1)]


def make_spec(tick_cycles: int, max_ticks: int = 4) -> STachometer:
    return STachometer(encoder=Encoder(25), timing=Timing(1_000_000, tick_cycles, max_ticks), frac_bits=8)


def trace_of(changes: list[tuple[int, int]], n_clocks: int, start: int = 0) -> PinTrace:
    """Return pins that advance by so many quarters at such clocks."""
    quarters = np.cumsum([start] + [by for _, by in changes]) % 4
    a, b = np.array([QUARTERS[k] for k in quarters], dtype=np.uint8).T
    return PinTrace(np.array([0] + [clock for clock, _ in changes]), a, b, n_clocks)


@pytest.mark.parametrize("tick_cycles", only([3], [2, 3, 8]))
def test_an_edge_is_counted_in_the_window_of_its_clock_and_pin_to_count(tick_cycles: int) -> None:
    spec = make_spec(tick_cycles)
    for clock in range(1, 3 * tick_cycles + 2):
        ticks = PySim().run(spec, trace_of([(clock, 1)], n_clocks=8 * tick_cycles)).ticks
        window = (clock + spec.latency.pin_to_count) // tick_cycles
        assert ticks.pulse_count.tolist() == [int(k == window) for k in range(len(ticks.clock))], clock
        assert ticks.position.tolist() == [int(k >= window) for k in range(len(ticks.clock))], clock


@pytest.mark.parametrize("tick_cycles", [2, 5, 16, 40])
def test_latencies_are_those_of_the_manifest(tick_cycles: int) -> None:
    spec = make_spec(tick_cycles)
    run = PySim().run(spec, trace_of([], n_clocks=20 * tick_cycles + 50))
    assert run.ticks.clock[:20].tolist() == [(k + 1) * tick_cycles - 1 + spec.latency.tick for k in range(20)]
    # At rest every update is forced: the first at tick 3, then every second tick.
    assert run.updates.clock[:8].tolist() == [
        run.ticks.clock[3 + 2 * k] + spec.latency.tick_to_velocity for k in range(8)
    ]


@pytest.mark.parametrize("start", range(4))
def test_no_count_and_no_error_after_reset_whatever_the_pins_rest_at(start: int) -> None:
    run = PySim().run(make_spec(4), trace_of([], 100, start))
    assert not run.ticks.position.any()
    assert not run.errors.size


@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("by", [1, -1, 2])
def test_the_first_clock_after_reset_is_the_first_that_can_see_a_change(start: int, by: int) -> None:
    run = PySim().run(make_spec(4), trace_of([(1, by)], 60, start))
    assert run.ticks.position[-1] == (0 if by == 2 else by)
    assert run.errors.tolist() == ([1 + make_spec(4).latency.pin_to_count] if by == 2 else [])


def test_position_is_the_sum_of_the_pulse_numbers_while_tick_is_high() -> None:
    rng = np.random.default_rng(3)
    clocks = np.cumsum(rng.integers(1, 4, size=2000)).tolist()
    run = PySim().run(make_spec(7), trace_of([(c, int(rng.choice([1, 1, -1]))) for c in clocks], clocks[-1] + 50))
    assert np.array_equal(np.cumsum(run.ticks.pulse_count), run.ticks.position)


class Resettable(Component):
    """A tachometer whose reset can be driven."""

    def __init__(self, spec: STachometer) -> None:
        self.core = Tachometer(spec)
        super().__init__({"reset": In(1), "quarter": In(2), "position": Out(32), "tick": Out(1), "velocity": Out(32)})

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.core = ResetInserter(self.reset)(self.core)
        a, b = Signal(), Signal()
        m.d.comb += [
            a.eq(self.quarter[0] ^ self.quarter[1]),
            b.eq(self.quarter[1]),
            self.core.a.eq(a),
            self.core.b.eq(b),
            self.position.eq(self.core.position),
            self.tick.eq(self.core.tick),
            self.velocity.eq(self.core.velocity),
        ]
        return m


def test_reset_in_the_middle_starts_over() -> None:
    spec = make_spec(4)
    seen: list[list[tuple[int, ...]]] = []

    async def bench(ctx: Any) -> None:
        for _ in range(2):
            rows = []
            for clock in range(200):
                ctx.set(dut.reset, 0)
                ctx.set(dut.quarter, (2 + clock // 3) % 4)
                rows.append(tuple(int(ctx.get(signal)) for signal in (dut.tick, dut.position, dut.velocity)))
                await ctx.tick()
            seen.append(rows)
            ctx.set(dut.reset, 1)
            ctx.set(dut.quarter, 2)
            await ctx.tick().repeat(3)

    dut = Resettable(spec)
    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(bench)
    simulator.run()
    assert seen[0] == seen[1]
    assert any(position for _, position, _ in seen[0])


def test_every_component_says_what_its_limits_are() -> None:
    ports = {port.name for port in make_spec(4).ports}
    core = Tachometer(make_spec(4))
    assert ports - {"clk", "rst"} == set(core.signature.members)
    assert list(itertools.chain(core.datapath.probes))[:2] == ["alteration", "m_s"]
