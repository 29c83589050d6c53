"""The whole core: latencies of the manifest, hand-over, reset, position."""

import itertools
import re

import numpy as np
import pytest
from support.nightly import only
from support.simulate import Resettable, Seen, clock_by_clock

from tachometry.hdl import Tachometer
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.spec import METHODS, Encoder, STachometer, TachometerSpec, Timing, of_texts

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


def test_reset_in_the_middle_starts_over() -> None:
    outputs = ("tick", "position", "velocity")
    turning = [dict(zip("ab", QUARTERS[(2 + clock // 3) % 4], strict=True)) | {"rst": 0} for clock in range(200)]
    reset = [{"a": 1, "b": 1, "rst": 1}] * 3
    seen = list(clock_by_clock(Resettable(Tachometer(make_spec(4))), [*turning, *reset, *turning], outputs))
    assert seen[:200] == seen[203:]
    assert any(row["position"] for row in seen[:200])


def test_every_component_says_what_its_limits_are() -> None:
    ports = {port.name for port in make_spec(4).ports}
    core = Tachometer(make_spec(4))
    assert ports - {"clk", "rst"} == set(core.signature.members)
    assert list(itertools.chain(core.datapath.probes))[:2] == ["alteration", "m_s"]


GOES_ON = {"position", "age", "filtered_edges"}


def shown(spec: TachometerSpec) -> Seen:
    """Return all outputs, clock by clock, of three ticks fast, of three slow, and of rest, with glitches."""
    tick, rng = spec.timing.tick_cycles, np.random.default_rng(1)
    chance = np.repeat([10 / tick, 0.7 / tick, 0], [3 * tick, 3 * tick, spec.times.longest + 2 * tick])
    level = quadrature(np.cumsum(rng.random(len(chance)) < chance))
    a, b, z = level & 1 ^ (rng.random(len(level)) < 3 / tick), level >> 1, level == 0
    rows = [{"a": int(x), "b": int(y), "z": int(w)} for x, y, w in zip(a, b, z, strict=True)]
    return clock_by_clock(Tachometer(spec), rows, [port.name for port in spec.ports.outputs])


@pytest.mark.parametrize("method", METHODS)
def test_outputs_are_held_until_their_strobe(method: str) -> None:
    texts = {"ppr": "3", "clock": "1MHz", "age": "yes", "filter": "2", "index": "yes"}
    tick = 800 if method == "track" else 80
    spec = of_texts(method, texts | {"tick": f"{tick}us", "max-time": f"{4 * tick}us"})
    seen = shown(spec)
    moved = set()
    for strobe, names in spec.ports.strobes.items():
        first = next((clock for clock, row in enumerate(seen) if row[strobe]), len(seen))
        between = [pair for pair in zip(seen[first:], seen[first + 1 :], strict=False) if not pair[1][strobe]]
        moved |= {name for name in names if any(row[name] != before[name] for before, row in between)}
    assert moved == GOES_ON
    assert {port.name for port in spec.ports if re.search("etween (the )?ticks", port.help)} == GOES_ON
