"""The index: captured position and its reset, through the whole core."""

import numpy as np
import pytest

from tachometry.sim import golden
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import compare
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.index import Index

# A forward edge at each of the clocks 10, 20 … 90; Z rises with the fourth of them.
CLOCK = np.arange(0, 100, 10)
A, B = np.array([0, 1, 1, 0] * 3)[:10].astype(np.uint8), np.array([0, 0, 1, 1] * 3)[:10].astype(np.uint8)
Z = np.array([0, 0, 0, 0, 1, 1, 0, 0, 0, 0], dtype=np.uint8)


def make_spec(*, reset: bool = False, filter_clocks: int = 0) -> STachometer:
    return STachometer(
        encoder=Encoder(25), timing=Timing(1_000_000, 4, 4), index=Index(reset, "edge"), filter_clocks=filter_clocks
    )


def check(*, reset: bool, z: np.ndarray = Z, filter_clocks: int = 0) -> PinTrace:
    trace = PinTrace(CLOCK, A, B, 140, z)
    spec = make_spec(reset=reset, filter_clocks=filter_clocks)
    run = PySim().run(spec, trace)
    assert compare(golden.run(spec, trace), run) == (0, [])
    rises = 10 * np.flatnonzero(np.diff(z.astype(int), prepend=z[0]) > 0)
    assert run.index.clock.tolist() == (rises + spec.latency.pin_to_count + 2).tolist()
    # The edge that comes together with Z counts as before it.
    counted = rises // 10
    before = np.append(0, counted[:-1]) if reset else 0
    assert run.index.index_position.tolist() == (counted - before).tolist()
    assert run.ticks.position[-1] == 9 - (counted[-1] if reset and len(counted) else 0)
    assert run.ticks.pulse_count.sum() == 9
    return trace


@pytest.mark.parametrize("reset", [False, True])
@pytest.mark.parametrize("filter_clocks", [0, 3])
def test_position_is_captured_and_reset(reset: bool, filter_clocks: int) -> None:
    check(reset=reset, filter_clocks=filter_clocks)
    check(reset=reset, z=np.array([0, 1, 0, 1, 0, 1, 1, 0, 1, 0], dtype=np.uint8), filter_clocks=filter_clocks)


def test_an_index_that_is_high_from_the_start_has_not_risen() -> None:
    check(reset=True, z=np.array([1, 1, 0, 0, 0, 0, 0, 1, 1, 1], dtype=np.uint8))


@pytest.mark.parametrize(("place", "first"), [("edge", []), ("A=0,B=0", [4]), ("A=1,B=1", [2])])
def test_what_is_high_at_reset_is_an_index_when_it_comes_again(place: str, first: list[int]) -> None:
    """Z stays high, and the shaft begins at A=0,B=0: in that state it has been from the start."""
    trace = PinTrace(CLOCK, A, B, 140, np.ones(10, dtype=np.uint8))
    spec = STachometer(encoder=Encoder(25), timing=Timing(1_000_000, 4, 4), index=Index(False, place))
    run = PySim().run(spec, trace)
    assert compare(golden.run(spec, trace), run) == (0, [])
    assert run.index.index_position[:1].tolist() == first


def test_a_glitch_on_the_index_is_swallowed_and_counted() -> None:
    clock = np.sort(np.append(CLOCK, [33, 35]))
    row = np.searchsorted(CLOCK, clock, side="right") - 1
    trace = PinTrace(clock, A[row], B[row], 140, (clock == 33).astype(np.uint8))
    spec = make_spec(filter_clocks=3)
    run = PySim().run(spec, trace)
    assert compare(golden.run(spec, trace), run) == (0, [])
    assert len(run.index.clock) == 0
    assert run.ticks.swallowed_edges[-1] == 2
