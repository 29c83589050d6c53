"""The mutants of a core are judged here."""

import re
import tempfile
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from proofs.mutation.cases import Case
from proofs.mutation.netlist import GROUP, Mutant, exported, mutants
from proofs.mutation.simulate import library, run
from proofs.mutation.stimulus import Stimulus

from tachometry.sim import build
from tachometry.sim.signals.run import compare, observed

CLOCKS = 400_000  # of the stimulus


@dataclass(frozen=True)
class Score:
    """Mutants of a core, and the indices of those that no output shows."""

    case: Case
    mutants: list[Mutant]
    survivors: list[int]

    @property
    def digest(self) -> str:
        """Digest of the sample, without the lines of the HDL."""
        return build.digest(*(re.sub(r" -src \S+", "", mutant.command) for mutant in self.mutants))


def judge(case: Case, pool: Executor, played: Stimulus | None = None) -> Score:
    """Play a stimulus on all mutants of a core, that of `CLOCKS` clocks if none is given.

    It raises AssertionError if the core without a mutant differs from the golden model.
    """
    played = played or case.play(CLOCKS)
    with tempfile.TemporaryDirectory() as folder, patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        flat, found = mutants(exported(case.component), case.mutants, Path(folder), case.selection)
    killed = np.full(len(found), -1, dtype=np.int64)

    def judged(first: int) -> NDArray[np.int64]:
        """Play a group; return the rows of the core from the first one."""
        group = slice(first, first + GROUP)
        n_rows = 0 if first or not played.traces else len(played.pins)
        return run(library(case.pins, flat, found[group]), killed[group], len(case.pins.outputs), played.pins, n_rows)

    rows, *_ = pool.map(judged, range(0, len(found), GROUP))
    with patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        hold(case, played, rows)
    return Score(case, found, np.flatnonzero(killed < 0).tolist())


def hold(case: Case, played: Stimulus, rows: NDArray[np.int64]) -> None:
    """Hold the core without a mutant against the golden model, from reset to reset."""
    for trace, start in zip(played.traces, played.starts, strict=True):
        own = rows[(rows[:, 0] >= start) & (rows[:, 0] < start + trace.n_clocks)]
        own[:, 0] -= start
        count, first = compare(case.right(trace), observed(case.spec, trace.n_clocks, own))
        assert count == 0, f"{case.name}, from clock {start}: {first[0]}"
