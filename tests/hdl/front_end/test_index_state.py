"""An index that is taken in a state of the lines is one place, and tells when it cannot be."""

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, of_texts, with_axes
from tachometry.spec.core.extras.health import Fault
from tachometry.spec.core.sensors import SENSORS

BASE = {"ppr": "8", "clock": "1MHz", "tick": "40us", "max-time": "400us", "index": "yes"}
ENGINE = Cxxrtl()  # compiles a core once
SKEW = 3  # clocks by which Z comes early or late


def spec_of(**texts: str) -> TachometerSpec:
    return of_texts("s", BASE | {name.replace("_", "-"): text for name, text in texts.items()})


def over_the_index(seed: int, reversals: int, width: int, state: tuple[int, int] = (1, 1)) -> PinTrace:
    """Return a shaft that turns back again and again about an index so many quarters wide, whose edges are early or
    late by up to `SKEW` clocks each.

    The state is in it, and not at both of its ends.
    """
    rng = np.random.default_rng(seed)
    middle = SENSORS["quadrature"].cycle.index(state)
    first = middle - (width - 1) // 2
    turns = rng.integers(first - 3, first + width + 3, reversals)
    steps = np.diff(np.append(0, turns))
    quarter = np.append(0, np.cumsum(np.repeat(np.sign(steps), np.abs(steps))))
    clock = 10 + np.append(0, np.cumsum(rng.integers(2 * SKEW + 2, 12, len(quarter) - 1)))
    slot = (quarter >= first) & (quarter < first + width)
    edge = np.flatnonzero(np.diff(slot)) + 1
    at_z = clock[edge] + rng.integers(-SKEW, SKEW + 1, len(edge))
    every = np.union1d(np.append(0, clock), at_z)
    level = quadrature(quarter[np.maximum(np.searchsorted(clock, every, side="right") - 1, 0)])
    z = (np.searchsorted(at_z, every, side="right") + slot[0]) & 1
    return PinTrace(every, level & np.uint8(1), level >> np.uint8(1), int(every[-1]) + 100, z.astype(np.uint8))


def places(run_index: NDArray[np.int64]) -> set[int]:
    return {*run_index.tolist()}


@pytest.mark.parametrize(("width", "decoding"), [(1, "4"), (2, "2"), (3, "1"), (4, "4")])
def test_ten_thousand_reversals_find_one_place(width: int, decoding: str) -> None:
    trace = over_the_index(width, 10_000, width)
    run = golden.run(spec_of(decoding=decoding), trace)  # by default
    assert len(run.index) > 3000
    assert places(run.index.index_position) == {{"4": 2, "2": 1, "1": 1}[decoding]}
    assert len(run.tables["index_wide"]) == 0
    assert len(run.tables["index_missed"]) < 20  # Z that comes early each time knows the direction before the turn
    # The edge is at several.
    if decoding == "4":
        assert len(places(golden.run(spec_of(index_at="edge"), trace).index.index_position)) > 1


@pytest.mark.parametrize("state", ["A=0,B=0", "A=1,B=0", "A=1,B=1", "A=0,B=1"])
@pytest.mark.parametrize("width", [1, 4])
def test_hardware_finds_it_too(width: int, state: str) -> None:
    levels = int(state[2]), int(state[6])
    trace = over_the_index(7, 90, width, levels)
    spec = spec_of(index_at=state, index_reset="yes", filter=("0", "2")[width == 1])
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0, found.first
    index = found.actual.index.index_position
    assert len(index) > 12
    assert places(index[1:]) == {0}  # where it was set to 0
    assert index[0] == SENSORS["quadrature"].cycle.index(levels)


@pytest.mark.parametrize(
    "texts", [{}, {"reverse": "yes"}, {"invert": "b,z"}, {"decoding": "1", "filter": "2"}, {"sensor": "pulses"}]
)
@pytest.mark.parametrize("seed", only([0], range(3)))
def test_a_wide_index_is_told(seed: int, texts: dict[str, str]) -> None:
    """Also of lines that jump, and of a Z that knows nothing of them."""
    rng = np.random.default_rng(seed)
    state = "A=1" if "sensor" in texts else "A=1,B=0"
    spec = spec_of(index_at=state, **texts)
    clock = np.append(0, np.cumsum(rng.integers(1, 6, 900)))
    drift = np.repeat(rng.choice([1, -1], 30), 31)[: len(clock)]
    level = quadrature(np.cumsum(np.where(rng.random(len(clock)) < 0.8, drift, rng.integers(-1, 3, len(clock)))))
    z = (np.cumsum(rng.random(len(clock)) < np.where(clock < clock[600], 0.06, 0.5)) & 1).astype(np.uint8)
    trace = PinTrace(clock, level & np.uint8(1), level >> np.uint8(1), int(clock[-1]) + 50, z)
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.tables["index_wide"]) > 3
    assert len(found.actual.tables["index_missed"]) > 1 or "sensor" in texts
    assert len(found.actual.index) > 10


def passing(quarter: NDArray[np.int64], begin: int, width: int, late: int = 0, *, noise: bool = False) -> PinTrace:
    """Return a shaft in these quarters, nine clocks each, and an index from `begin` on, `late` clocks late.

    With noise it falls back for two clocks after each edge.
    """
    clock = 10 + np.arange(len(quarter)) * 9
    slot = (quarter >= begin) & (quarter < begin + width)
    edges = clock[1:][np.diff(slot)] + late
    edges = np.concatenate([edges, edges + 2, edges + 4]) if noise else edges
    every = np.union1d(np.append(0, clock), edges)
    level = quadrature(quarter[np.maximum(np.searchsorted(clock, every, side="right") - 1, 0)])
    z = (np.searchsorted(np.sort(edges), every, side="right") & 1).astype(np.uint8)
    return PinTrace(every, level & np.uint8(1), level >> np.uint8(1), int(every[-1]) + 60, z)


@pytest.mark.parametrize("decoding", ["4", "1"])
@pytest.mark.parametrize(("begin", "width"), [(0, 1), (3, 1), (-1, 3), (2, 1), (1, 4)])
def test_an_index_beside_its_state_is_told_each_time_and_one_in_it_never(begin: int, width: int, decoding: str) -> None:
    """The state of A=1,B=1 is quarter 2; a shaft that turns back in the index has not passed it, in time or late."""
    late = SKEW * (begin == 0)
    passes = np.concatenate([np.arange(-9, 13), np.arange(12, -10, -1), np.arange(-9, 13)])
    back = np.concatenate([np.arange(-9, begin + 1), np.arange(begin, -10, -1)])
    for quarter, times in ((passes, 3), (back, 0)):
        found = lockstep(spec_of(decoding=decoding), passing(quarter, begin, width, late), ENGINE)
        assert found.n_mismatches == 0, found.first
        there = begin <= 2 < begin + width
        assert len(found.actual.tables["index_missed"]) == (0 if there else times)
        assert len(found.actual.index) == (0 if not there else 1 if begin == 2 and not times else times)


def test_levels_of_z_with_no_count_between_them_are_one_index() -> None:
    """As where its edges have noise, before the state and after it. A fault of --health tells that it is missed."""
    for begin, width, missed in ((2, 1, 0), (1, 2, 0), (3, 1, 1)):
        found = lockstep(spec_of(health="yes"), passing(np.arange(-4, 9), begin, width, noise=True), ENGINE)
        assert found.n_mismatches == 0, found.first
        assert len(found.actual.tables["index_missed"]) == missed
        assert found.actual.ticks.health[-1] == (Fault.INDEX_MISSED if missed else 0)


def test_an_index_of_eight_quarters_is_told_in_both_directions_and_one_of_four_never() -> None:
    spec = spec_of(index_at="A=1,B=1")
    for sign in (1, -1):
        quarter = np.arange(-6, 20)[::sign]
        level = quadrature(quarter)
        for width, told in ((4, 0), (8, 1)):
            z = ((quarter >= 1) & (quarter < 1 + width)).astype(np.uint8)
            trace = PinTrace(np.arange(26) * 9, level & np.uint8(1), level >> np.uint8(1), 300, z)
            run = ENGINE.run(spec, trace)
            assert compare(golden.run(spec, trace), run) == (0, [])
            assert len(run.tables["index_wide"]) == told, (sign, width)


@pytest.mark.parametrize(
    ("texts", "width", "skew"),
    [
        ({}, 1, 0.0),
        ({"reverse": "yes", "invert": "z"}, 2, -3e-6),
        ({}, 4, 3e-6),
        ({"sensor": "hall", "index-at": "A=1,B=0,C=0"}, 2, 3e-6),
    ],
)
def test_the_index_of_the_virtual_encoder_is_about_its_state(texts: dict[str, str], width: int, skew: float) -> None:
    spec = of_texts("s", BASE | {"index-at": "A=1,B=1"} | texts)
    encoder = VirtualEncoder.of(
        spec.encoder,
        index=True,
        index_state=spec.front_end.index_place,
        index_width=width,
        index_skew_s=skew,
        start_angle_rad=-0.65,
    )
    recording = encoder.record(parse_motion("sine:40rad/s:10Hz:1s")).recording
    found = golden.run(spec, PinTrace.of(recording, spec)).index.index_position
    assert len(found) >= 15
    turn = spec.encoder.counts_per_rev
    assert len({position % turn for position in found.tolist()}) == 1
    high = recording.z == ("z" not in spec.encoder.inverted)
    assert 0.01 < float(np.diff(recording.time, append=1.0) @ high) < 0.9


def test_of_many_axes_each_finds_its_own() -> None:
    alone = of_texts("s", BASE | {"index-at": "A=0,B=1"})
    spec = with_axes(alone, 2, parallel=False)
    found = lockstep(spec, stress_of(spec, 2, 8), PySim())
    assert found.n_mismatches == 0, found.first
    assert len(found.expected.tables["index_valid"]) > 2
