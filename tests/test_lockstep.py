"""Hardware and golden model on the same random motions: every update, every bit."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from support.lockstep import EVENTS, lockstep

from tachometry.sim.engines.pysim import PySim
from tachometry.spec import METHODS

# 24 seeds a method, among which every event of the coverage table happens. Hundreds of motions more are played where
# clocks are free, on the compiled cores of test_matrix.py.
SEEDS = {
    "s": [*range(22), 49, 59],
    "m": [*range(22), 23, 32],
    "t": [*range(23), 48],
    "mt": [*range(23), 48],
    "rairan": [*range(23), 45],
}
TABLES = Path(__file__).parent.parent / "build"


@pytest.mark.parametrize("method", METHODS)
def test_random_motions(method: str) -> None:
    problems: list[str] = []
    coverage: Counter[str] = Counter()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for wrong, found in pool.map(partial(lockstep, method=method, engine=PySim()), SEEDS[method]):
            problems += wrong
            coverage += found
    table = "\n".join(f"{event:<26}{coverage[event]:>9}" for event in EVENTS[method])
    TABLES.mkdir(exist_ok=True)
    (TABLES / f"lockstep_coverage_{method}.txt").write_text(f"{table}\n")
    assert not problems, "\n".join(problems[:20])
    assert all(coverage[event] for event in EVENTS[method]), table
