"""A golden model that is run in pieces, however small, gives every bit of the whole."""

import numpy as np
import pytest
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.golden.pieces import Golden, in_pieces
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.studies.pairs import core_of
from tachometry.spec import TachometerSpec

BASE = "--ppr 25 --clock 1MHz"
FAST, SLOW = f"{BASE} --tick 40us --max-time 600us", f"{BASE} --tick 500us --max-time 5ms"
CASES = [
    f"m {BASE} --tick 40us --average 3 --bounds --unit rad/s",
    f"s {FAST} --bounds --filter 5us",
    f"t {FAST} --bounds",
    f"t {FAST} --paper-exact --sensor pulses",
    f"mt {FAST} --bounds --decoding 2",
    f"mt {FAST} --paper-exact",
    f"mt {FAST} --whole-cycles --filter 4us --blanking 9us",
    f"track {SLOW} --smooth --sensor step-dir",
    f"m {BASE} --tick 40us --sensor hall",
    f"m {BASE} --tick 40us --decoding 2 --blanking 30us",
    f"t {FAST} --index",
    f"s {FAST} --decoding 1 --index --filter 4us --position-modulo 7",
    f"mt {FAST} --index --index-at edge --index-reset --preset 5 --position-modulo rev/7",
    f"m {BASE} --tick 40us --index --index-once --index-reset --preset -300 --filter 3us",
    f"track {SLOW} --index --decoding 2",
    f"m {BASE} --tick 40us --index --index-reset --invert z --preset 7",
    f"m {BASE} --tick 40us --sensor hall --index --invert a,z",
]


def in_order(spec: TachometerSpec, trace: PinTrace, ends: list[int], seed: int = 0) -> None:
    """Compare a run in pieces that end at some clocks, and the rest as one, with the whole."""
    whole, model, ends = golden.run(spec, trace).tables, Golden(spec), [*ends, trace.n_clocks]
    runs = [model.run(trace.part(begin, end)).tables for begin, end in zip([0, *ends], ends, strict=False)]
    for name, table in whole.items():
        found = runs[0][name]
        for more in runs[1:]:
            found = found.then(more[name])
        found = found.rows(found.clock < trace.n_clocks)  # updates may come before their clock
        for column in ("clock", *table.columns):
            np.testing.assert_array_equal(found[column], table[column], f"{name}.{column}, seed {seed}", strict=True)


@pytest.mark.parametrize("seed", only([1], range(20)))
@pytest.mark.parametrize("case", CASES)
def test_pieces_of_some_ticks_give_the_whole(case: str, seed: int) -> None:
    spec = core_of(("--method", *case.split()))
    assert isinstance(spec, TachometerSpec)
    rng, trace = np.random.default_rng(seed), stress_of(spec, seed, 12)
    assert isinstance(trace, PinTrace)
    most = 28 * spec.timing.tick_cycles  # 7 ticks in the mean
    lengths = 1 + (most * rng.random(50) ** 3).astype(int)  # many are of some clocks only
    in_order(spec, trace, [int(end) for end in np.cumsum(lengths) if end < trace.n_clocks], seed)


@pytest.mark.parametrize("case", [0, 11, 12, 13])
def test_pieces_of_a_clock_give_the_whole(case: int) -> None:
    """The index comes twice, as does an input that moves the position or arms it, if there is one."""
    spec, place = core_of(("--method", *CASES[case].split())).tachometer, np.arange(60)
    level, z = quadrature(place), place % 30 // 3 == 2
    trace = PinTrace(5 * place, level & np.uint8(1), level >> np.uint8(1), 330, z.astype(np.uint8)).completed(spec)
    for name in spec.front_end.controls:
        trace = trace.with_pulses(name, np.array([7, 120, 201, 290]), 4)
    in_order(spec, trace, [*range(1, 330)])


@pytest.mark.parametrize("more", ["--external-tick", "--over-speed 3rad/s", "--lowpass 200Hz", "--age"])
def test_cores_that_need_the_whole(more: str) -> None:
    assert not in_pieces(core_of(("--method", *CASES[1].split(), *more.split())).tachometer)
    assert in_pieces(core_of(("--method", *CASES[1].split())).tachometer)


@pytest.mark.parametrize("apart", [1, 100, 2000])  # steps between clocks in which Z is high; 1: it always is
def test_what_is_known_of_the_pins_does_not_grow_with_them(apart: int) -> None:
    spec, place = core_of(("--method", *CASES[10].split())).tachometer, np.arange(4000)
    level, z = quadrature(place), (place % apart == 0).astype(np.uint8)
    trace, model = (
        PinTrace(10 * place, level & np.uint8(1), level >> np.uint8(1), 40_000, z).completed(spec),
        Golden(spec),
    )
    for begin in range(0, 40_000, 4_000):
        model.run(trace.part(begin, begin + 4000))
        assert model._pins is not None
        assert len(model._pins.clock) < 20
