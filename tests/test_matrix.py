"""Every option with every other, at every length of tick and measurement: exported Verilog against the golden model."""

from pathlib import Path

import numpy as np
import pytest
from support.verilog import run_in_verilator

from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.signals.run import compare
from tachometry.sim.studies.pairs import configurations, spec_of
from tachometry.spec import METHODS

CORES = [words for method in METHODS for words in configurations(method)]


@pytest.mark.parametrize("words", CORES, ids=" ".join)
def test_every_pair_of_options(words: tuple[str, ...], tmp_path: Path) -> None:
    spec = spec_of(words)
    trace = stress(spec, seed=1)
    # The longest would take Verilator half a minute.
    fast = trace.n_clocks > 1e8
    actual = Cxxrtl().run(spec, trace) if fast else run_in_verilator(spec, tmp_path, trace)
    count, first = compare(golden.run(spec, trace), actual)
    assert count == 0, first
    # All that the configuration can show has happened.
    updates = actual.updates
    # Long windows and what waits for the filter give few updates.
    few = {"--min-time", "--lowpass"} & {*words}
    assert np.count_nonzero(~updates.forced) > (5 if few else 100)
    if "--paper-exact" not in words:
        assert spec.method == "m" or np.count_nonzero(updates.forced) > 1
        assert updates.stalled.any()
    assert bool(len(actual.errors)) or bool(spec.filter_clocks)
    assert bool(len(actual.index.clock)) == spec.index
    assert bool(len(actual.tick_errors)) == (spec.max_tick_cycles is not None)
    assert updates.get("velocity_overflow").any() <= ("--velocity-width" in words)
