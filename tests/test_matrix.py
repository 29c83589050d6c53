"""Every option with every other, at every length of tick and measurement: exported Verilog against the golden model."""

from pathlib import Path

import numpy as np
import pytest
from support.matrix import motion, rows, spec_of
from support.verilog import run_in_verilator

from tachometry.sim import golden
from tachometry.sim.results import compare


@pytest.mark.parametrize("row", rows(), ids=lambda row: "-".join(map(str, row.values())))
def test_every_pair_of_options(row: dict, tmp_path: Path) -> None:
    spec = spec_of(row)
    trace = motion(spec, seed=1)
    actual = run_in_verilator(spec, tmp_path, trace)
    count, first = compare(golden.run(spec, trace), actual)
    assert count == 0, first
    # All that the configuration can show has happened.
    updates = actual.updates
    assert np.count_nonzero(~updates.forced) > 100
    if not row.get("paper_exact"):
        assert np.count_nonzero(updates.forced) > 1
        assert updates.stalled.any()
    assert bool(len(actual.errors)) or bool(spec.filter_clocks)
    assert bool(len(actual.index.clock)) == spec.index
    assert bool(len(actual.tick_errors)) == (spec.max_tick_cycles is not None)
    assert updates.velocity_overflow.any() <= (row["velocity_bits"] == "too few")
