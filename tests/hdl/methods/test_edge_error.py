"""Bounds for discs and lines that are not ideal, in gates: to the bit those of the golden model."""

from typing import Any

import numpy as np
import pytest
from support.nightly import only_rows

from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pick import pick
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import METHODS, TachometerSpec, of_texts

CORE = {"ppr": "25", "clock": "1MHz", "tick": "12clk", "max-time": "120clk", "frac-bits": "6", "bounds": "yes"}
CASES: list[tuple[str, dict[str, str]]] = [
    ("s", {}),
    ("s", {"cancel": "no", "max-speed": "100000rpm"}),
    ("s", {"max-time": "96000clk", "tick": "12clk", "frac-bits": "4"}),
    ("m", {}),
    ("m", {"average": "8"}),
    ("m", {"average": "16", "frac-bits": "4"}),
    ("m", {"average": "5", "unit": "rpm", "frac-bits": "1"}),
    ("t", {}),
    ("t", {"timer": "tick"}),
    ("mt", {}),
    ("mt", {"timer": "tick"}),
    ("mt", {"unit": "rev/s", "frac-bits": "2", "velocity-width": "12"}),
    ("rairan", {}),
    ("rairan", {"estimate": "n1", "tick": "3clk", "max-time": "60clk"}),
    ("rairan", {"adaptive": "25%"}),
    ("rairan", {"tick": "1clk", "max-time": "20clk"}),
]


def spec_of(method: str, options: dict[str, str], error: str) -> TachometerSpec:
    return of_texts(method, CORE | options | {"edge-error": error})


def check(spec: TachometerSpec, seed: int) -> Any:
    trace = stress(spec, seed, 12)
    found = lockstep(spec, trace.until(min(trace.n_clocks, 3000)), pick("pysim"))
    assert found.n_mismatches == 0, found.first
    return found.actual.updates


# One of each method; the others have other widths and timers, which tests/test_matrix.py plays with an edge error.
@pytest.mark.parametrize(("method", "options"), only_rows([(method, {}) for method in METHODS], CASES), ids=str)
def test_gates_have_the_bounds_of_the_golden_model(method: str, options: dict[str, str]) -> None:
    updates = check(spec_of(method, options, "1" if options.get("frac-bits") else "0.375"), 1)
    assert np.count_nonzero(updates["bounds_valid"]) > 3
