"""Every option with every other, at every length of tick and measurement: exported Verilog against the golden model."""

from pathlib import Path

import numpy as np
import pytest
from support.nightly import nightly, only
from support.verilog import LintingVerilator

from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.compiled import CompiledEngine, Design
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.spec import METHODS

# A build takes seconds, a motion milliseconds: as many motions as these numbers allow are played on every core.
MOTIONS, CLOCKS, EDGES = 50, 2_000_000, 50
PARTS = 8  # which can be played beside each other


# One core is enough here, as Icarus plays others. With ticks of 3 clocks motions are short, and few, so the compiler
# need not optimise; the tracking method has only long ones.
@pytest.mark.parametrize("method", only(["mt"], METHODS))
def test_options_of_one_core(method: str, tmp_path: Path) -> None:
    words = next(words for words in configurations(method) if method == "track" or "3clk" in words)
    check(words, tmp_path, 10, 300_000)


@nightly
@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("method", METHODS)
def test_every_pair_of_options(method: str, part: int, tmp_path: Path) -> None:
    for place, words in enumerate(configurations(method)[part::PARTS]):
        check(words, tmp_path / str(place), MOTIONS, CLOCKS)


def check(words: tuple[str, ...], folder: Path, motions: int, left: int) -> None:
    folder.mkdir(exist_ok=True)
    spec = spec_of(words)
    # Long windows and what waits for the filter give few updates, as do edges that are not counted.
    rare = {"--min-time", "--lowpass"} & {*words}
    edges = 400 if rare else 300 if spec.timing.tick_cycles < 100 else 200
    trace = stress(spec, 1, edges if spec.encoder.decoding >= 4 else 3 * edges)
    n_clocks = trace.n_clocks + min(left, motions * stress(spec, 2, EDGES).n_clocks)
    verilator = LintingVerilator(folder, few=n_clocks < 3_000_000)
    engine: CompiledEngine = verilator
    if trace.n_clocks > 2e7:  # which would take Verilator long
        verilator.text(Design(spec, list(spec.ports.pins)))
        engine = Cxxrtl()
    found = lockstep(spec, trace, engine)
    assert found.n_mismatches == 0, found.first
    # All that the configuration can show has happened.
    actual, updates = found.actual, found.actual.updates
    assert np.count_nonzero(~updates.forced) > (5 if rare else 100)
    if "--paper-exact" not in words:  # a velocity that does not decay has one where the shaft rests
        assert spec.method == "m" or np.count_nonzero(updates.forced) > ("--no-bound-decay" not in words)
    assert actual.tables[spec.facts.rests_with].standstill.any()
    assert bool(len(actual.errors)) == (spec.encoder.sensor != "pulses") or bool(spec.filter_clocks)
    assert bool(len(actual.index.clock)) == (spec.index is not None)
    assert bool(len(actual.tick_errors)) == spec.external_tick
    assert updates.get("velocity_overflow").any() <= ("--velocity-width" in words)
    # The golden low-pass filter goes from update to update.
    for seed in range(2, 2 + (motions if spec.lowpass is None else motions // 10)):
        trace = stress(spec, seed, EDGES)
        left -= trace.n_clocks
        if left < 0:
            break
        found = lockstep(spec, trace, engine)
        assert found.n_mismatches == 0, f"seed {seed}: {found.first}"
