"""The exported Verilog, read without a warning, against the golden model in Icarus; in Verilator see test_matrix.py."""

from pathlib import Path

import pytest
from support.lockstep import random_case
from support.nightly import only_rows
from support.verilog import run_in_icarus

from tachometry.sim import golden
from tachometry.sim.signals.run import compare

CASES = [
    ("s", 3),
    ("s", 12),
    ("s", 38),
    ("s", 45),
    ("m", 2),
    ("m", 5),
    ("t", 5),
    ("t", 13),
    ("mt", 5),
    ("mt", 13),
    ("rairan", 3),
    ("rairan", 4),
    ("rairan", 82),
]


# Verilator reads a core of each method in tests/test_matrix.py, and Icarus in tests/independent/test_cores.py.
FEW = [("s", 45), ("rairan", 3)]


@pytest.mark.parametrize(("method", "seed"), only_rows(FEW, CASES))
def test_exported_verilog_agrees_with_the_golden_model(method: str, seed: int, tmp_path: Path) -> None:
    spec, _, trace = random_case(seed, method)
    actual = run_in_icarus(spec, tmp_path, trace)
    assert len(actual.updates.clock) >= 100
    count, first = compare(golden.run(spec, trace), actual)
    assert count == 0, f"{method}, seed {seed}: {first}"
