"""Clocks that CXXRTL skips: every row is that of a simulation which skips none."""

from fractions import Fraction
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.nightly import nightly, only, only_rows

from tachometry.hdl.arithmetic.idle import IdleCounter
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.compiled import Design, Play
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.spec import METHODS, AxesSpec, STachometer, TachometerSpec, of_texts
from tachometry.spec.control import AnySpec, LoopSpec


def turning(distances: list[int], number: int, then: int) -> PinTrace:
    """Return so many edges, clocks apart by turns, and what follows the last."""
    clock = np.cumsum(np.append(0, np.resize(distances, number - 1)))
    level = np.arange(number) % 4
    a, b = (np.isin(level, high).astype(np.uint8) for high in ((1, 2), (2, 3)))
    return PinTrace(clock, a, b, n_clocks=int(clock[-1]) + then)


def check(spec: AnySpec, trace: Any) -> float:
    """Return the part of the clocks that are skipped; the rows must be those of every clock."""
    design = Design(spec, list(spec.ports.pins))
    library = Cxxrtl().library(design)
    skipping, every = (Play(library, design, trace, (0, trace.n_clocks), every_clock=each) for each in (False, True))
    for play in (skipping, every):
        play.to_the_end(None, None)
    np.testing.assert_array_equal(skipping.rows(), every.rows())
    assert not every.skipped
    return skipping.skipped / trace.n_clocks


# One with sums; a timer and its divider are those of the filter of milliseconds below.
@pytest.mark.parametrize(("method", "whole"), only_rows([("m", False)], [*product(METHODS, [False, True])]))
def test_rows_are_those_of_every_clock(method: str, whole: bool) -> None:
    """On random motions; and with edges far apart, so that whole ticks are skipped."""
    cores = [spec_of(words) for words in configurations(method)[slice(None) if whole else slice(3, 4)]]
    for spec in cores:
        if Tachometer(spec).idle:  # else nothing is skipped
            check_core(spec)


def check_core(spec: TachometerSpec) -> None:
    trace = stress(spec, 3, 50)
    if trace.n_clocks > 5e6:
        trace = trace.until(5_000_000)
    check(spec, trace)
    cycles = spec.tick.longest
    slow = turning([3 * cycles + 1, 5, max(cycles - 1, 1)], 12, 5 * cycles)
    low = np.zeros(12, dtype=np.uint8)
    others: dict[str, Any] = {pin.name: low for pin in spec.ports.pins if pin.name not in slow.lines}
    check(spec, PinTrace.of_lines(slow.clock, slow.n_clocks, {**slow.lines, **others}))


def test_ticks_of_two_clocks_have_nothing_to_skip() -> None:
    """Their counter is one bit, which has no name of its own."""
    check_core(of_texts("s", {"ppr": "8", "tick": "2clk", "max-time": "6clk"}))


def slow_shaft(method: str, **texts: str) -> tuple[TachometerSpec, PinTrace]:
    """Return a core with long ticks, and edges with seconds between them."""
    spec = of_texts(method, {"ppr": "16", "clock": "1MHz", "tick": "1ms", **texts})
    return spec, turning([1500, 40_000, 150, 1_500_000, 990], 12, 1_500_000)


def slow(method: str) -> tuple[TachometerSpec, PinTrace]:
    """Return a core of the method, or one with ticks so long that they are counted."""
    return slow_shaft("s", tick="5ms", **{"max-time": "50ms"}) if method == "long" else slow_shaft(method)


# The divider of S, and long ticks; a timer is in the core below.
@pytest.mark.parametrize("method", only(["s", "long"], [*METHODS, "long"]))
def test_slow_shafts(method: str) -> None:
    """Nearly all of their clocks are skipped."""
    assert check(*slow(method)) > 0.8


def test_a_filter_of_milliseconds() -> None:
    """The time that a level has held is skipped as well."""
    assert check(*slow_shaft("t", filter="10ms")) > 0.8


def test_many_axes() -> None:
    """Their rounds are skipped, also where edges at the beginning of a round are few rounds apart."""
    axis = of_texts("s", {"ppr": "16", "clock": "1MHz", "tick": "1ms", "max-time": "9ms"})
    assert isinstance(axis, STachometer)
    distances = ([4000, 8, 12, 16, 20, 24, 28], [9000, 7000, 5], [1000, 20_001], [30_000])
    each = tuple(turning(list(one), 60, 0) for one in distances)
    assert check(AxesSpec(tachometer=axis, axes=4), AxesTrace.of(each)) > 0.8


@nightly  # tests/sim/engines/test_gate_loop.py skips clocks of such a core, too
def test_a_loop_in_gates() -> None:
    """Its commands change between control ticks."""
    tachometer = of_texts("s", {"ppr": "16", "clock": "1MHz", "tick": "1ms"})
    gains = {"position_gain": 1600, "velocity_gain": 80, "observer": 160, "current_limit": 8}
    spec = LoopSpec(tachometer=tachometer, **{name: Fraction(value) for name, value in gains.items()})  # type: ignore[arg-type]
    trace = turning([1500, 700, 4000], 300, 0)
    rng = np.random.default_rng(1)
    lines = {pin.name: rng.integers(0, 1 << pin.width, len(trace.clock), np.uint64) for pin in spec.ports.pins}
    played = SimpleNamespace(clock=trace.clock, n_clocks=trace.n_clocks, lines={**lines, **trace.lines})
    assert check(spec, played) > 0.8


def test_a_counter_that_does_not_exist_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Tachometer, "idle", (IdleCounter("sampling_clock.none", -1, (-1,)),))
    spec, trace = slow_shaft("m", filter="2")
    with pytest.raises(AssertionError, match="no such signals: "):
        Cxxrtl().run(spec, trace)
