"""Hardware and golden model on the same random motions: every update, every bit."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import pytest
from support.events import EVENTS
from support.lockstep import lockstep
from support.nightly import nightly, only

from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.engines.engine import Engine
from tachometry.sim.engines.pysim import PySim
from tachometry.spec import METHODS

# Seeds among which every event of the coverage table happens; they are some with few clocks, as pysim takes long.
# Hundreds of motions more, with longer ticks, are played on the compiled cores of test_matrix.py.
SEEDS = {
    "s": [1, 11, 23, 35, 37, 38, 57, 69, 81, 94, 142, 147],
    "m": [1, 23, 27, 34, 47, 49, 57, 77, 81, 94, 107, 123],
    "t": [3, 9, 17, 25, 27, 31, 43, 49, 51, 60, 70, 80],
    "mt": [3, 9, 17, 20, 25, 31, 43, 44, 51, 60, 70, 80],
    "rairan": [0, 9, 20, 22, 24, 30, 31, 42, 43, 44, 51, 61],
    "track": [3, 4, 8, 19, 37, 54, 66, 73],
}
QUICK = {"s": 57, "m": 77, "t": 25, "mt": 25, "rairan": 22, "track": 19}
# A tick of track is hundreds of clocks, which are too many for pysim.
ENGINES: dict[str, Engine] = {"track": Cxxrtl()}
TABLES = Path(__file__).parent.parent / "build"


# A core of track is compiled for this; tests/test_matrix.py has one.
@pytest.mark.parametrize("method", only([method for method in METHODS if method not in ENGINES], METHODS))
def test_a_random_motion(method: str) -> None:
    """One that takes little time; for every event all of them are needed."""
    assert QUICK[method] in SEEDS[method]
    problems, _ = lockstep(QUICK[method], method, ENGINES.get(method, PySim()))
    assert not problems, "\n".join(problems[:20])


@nightly
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
