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


def test_an_edge_at_the_end_of_a_piece_is_counted_in_the_next() -> None:
    spec, quarter = core_of(("--method", *CASES[0].split())).tachometer, np.arange(20)
    level = quadrature(quarter)
    in_order(
        spec, PinTrace(np.append(0, 60 + quarter[1:]), level & np.uint8(1), level >> np.uint8(1), 200), [*range(61, 90)]
    )


@pytest.mark.parametrize("more", ["--index", "--external-tick", "--over-speed 3rad/s", "--lowpass 200Hz", "--age"])
def test_cores_that_need_the_whole(more: str) -> None:
    assert not in_pieces(core_of(("--method", *CASES[1].split(), *more.split())).tachometer)
    assert in_pieces(core_of(("--method", *CASES[1].split())).tachometer)
