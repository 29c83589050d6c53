"""Hardware and golden model on the same random motions: every update, every bit."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from support.events import EVENTS
from support.lockstep import lockstep

from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.engines.engine import Engine
from tachometry.sim.engines.pysim import PySim
from tachometry.spec import METHODS

# 24 seeds a method, among which every event of the coverage table happens; they are some with few clocks, which pysim
# takes long for. Hundreds of motions more, with longer ticks, are played on the compiled cores of test_matrix.py.
SEEDS = {
    "s": [1, 4, 5, 11, 21, 23, 30, 35, 37, 38, 42, 47, 48, 57, 60, 65, 69, 81, 94, 97, 107, 112, 142, 147],
    "m": [1, 6, 9, 11, 14, 23, 27, 34, 35, 38, 42, 47, 48, 49, 57, 65, 74, 77, 81, 94, 107, 123, 142, 147],
    "t": [0, 2, 3, 6, 9, 10, 14, 16, 17, 20, 22, 24, 25, 26, 27, 31, 38, 43, 44, 49, 51, 60, 70, 80],
    "mt": [0, 2, 3, 6, 9, 10, 14, 16, 17, 20, 22, 24, 25, 26, 27, 30, 31, 38, 43, 44, 51, 60, 70, 80],
    "rairan": [0, 2, 3, 6, 9, 10, 14, 16, 20, 21, 22, 24, 25, 26, 30, 31, 35, 38, 42, 43, 44, 61, 51, 56],
    "track": [2, 3, 5, 6, 8, 9, 10, 14, 17, 19, 21, 23, 28, 29, 37, 38, 39, 40, 52, 58, 61, 75, 76, 77],
}
# A tick of track is hundreds of clocks, which are too many for pysim.
ENGINES: dict[str, Engine] = {"track": Cxxrtl()}
TABLES = Path(__file__).parent.parent / "build"


@pytest.mark.parametrize("method", METHODS)
def test_random_motions(method: str) -> None:
    problems: list[str] = []
    coverage: Counter[str] = Counter()
    play = partial(lockstep, method=method, engine=ENGINES.get(method, PySim()))
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for wrong, found in pool.map(play, SEEDS[method]):
            problems += wrong
            coverage += found
    table = "\n".join(f"{event:<26}{coverage[event]:>9}" for event in EVENTS[method])
    TABLES.mkdir(exist_ok=True)
    (TABLES / f"lockstep_coverage_{method}.txt").write_text(f"{table}\n")
    assert not problems, "\n".join(problems[:20])
    assert all(coverage[event] for event in EVENTS[method]), table
