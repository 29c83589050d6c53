"""The mutants of a core are judged here."""

import tempfile
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from proofs.mutation.argued import argued
from proofs.mutation.cases import Case
from proofs.mutation.equivalent import equivalent
from proofs.mutation.netlist import GROUP, Mutant, exported, mutants
from proofs.mutation.simulate import library, run
from proofs.mutation.stimulus import Stimulus

from tachometry.sim.signals.run import compare, observed

CLOCKS = 400_000  # of the stimulus


@dataclass(frozen=True)
class Score:
    """Counts the mutants of a core, and holds the survivors that nothing shows to be equivalent."""

    case: Case
    mutants: int
    killed: int
    equivalent: int
    argued: int
    survivors: list[Mutant]


def judge(case: Case, pool: Executor, played: Stimulus | None = None) -> Score:
    """Play a stimulus on all mutants of a core, that of `CLOCKS` clocks if none is given.

    Raises
    ------
    AssertionError
        If the core without a mutant differs from the golden model.
    """
    played = played or case.play(CLOCKS)
    n_outputs = len(case.pins.outputs)
    with tempfile.TemporaryDirectory() as folder, patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        flat, found = mutants(exported(case.component), case.mutants, Path(folder), case.selection)

    def group(first: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        some = found[first : first + GROUP]
        rows = 0 if first or not played.traces else len(played.pins)
        return run(library(case.pins, flat, some), len(some), n_outputs, played.pins, rows)

    groups = list(pool.map(group, range(0, len(found), GROUP)))
    with patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        hold(case, played, groups[0][1])
    killed = [bool(clock >= 0) for clocks, _ in groups for clock in clocks]
    left = [mutant for mutant, dead in zip(found, killed, strict=True) if not dead]
    alike: list[bool] = []
    for first in range(0, len(left), GROUP):
        with tempfile.TemporaryDirectory() as folder:
            alike += equivalent(case, flat, left[first : first + GROUP], played.pins, Path(folder), pool)
    unproven = [mutant for mutant, same in zip(left, alike, strict=True) if not same]
    survivors = [mutant for mutant in unproven if not argued(case.name, mutant)]
    return Score(case, len(found), sum(killed), sum(alike), len(unproven) - len(survivors), survivors)


def hold(case: Case, played: Stimulus, rows: NDArray[np.int64]) -> None:
    """Hold the core without a mutant against the golden model, from reset to reset."""
    for trace, start in zip(played.traces, played.starts, strict=True):
        own = rows[(rows[:, 0] >= start) & (rows[:, 0] < start + trace.n_clocks)]
        own[:, 0] -= start
        count, first = compare(case.right(trace), observed(case.spec, trace.n_clocks, own))
        assert count == 0, f"{case.name}, from clock {start}: {first[0]}"
