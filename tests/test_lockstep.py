"""Hardware and golden model on the same random motions: every update, every bit."""

import os
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from support.lockstep import EVENTS, lockstep

from tachometry.sim.pysim import PySim

SEEDS = range(200)
TABLE = Path(__file__).parent.parent / "build" / "lockstep_coverage.txt"


def test_random_motions() -> None:
    problems: list[str] = []
    coverage: Counter[str] = Counter()
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        for wrong, found in pool.map(partial(lockstep, engine=PySim()), SEEDS):
            problems += wrong
            coverage += found
    table = "\n".join(f"{event:<26}{coverage[event]:>9}" for event in EVENTS)
    TABLE.parent.mkdir(exist_ok=True)
    TABLE.write_text(f"{table}\n")
    assert not problems, "\n".join(problems[:20])
    assert all(coverage[event] for event in EVENTS), table
