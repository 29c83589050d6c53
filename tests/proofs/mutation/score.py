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
from proofs.mutation.cones import alike
from proofs.mutation.equivalent import equivalent
from proofs.mutation.netlist import GROUP, Mutant, exported, mutants
from proofs.mutation.simulate import library, run
from proofs.mutation.stimulus import Stimulus

from tachometry.sim.signals.run import compare, observed
from tachometry.spec import TrackTachometer

CLOCKS = 400_000  # of the stimulus
_LITTLE = 8  # part of it, after which it is worth a proof to be still there


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

    killed = np.full(len(found), -1, dtype=np.int64)
    proven = np.zeros(len(found), dtype=bool)

    def judged(first: int) -> NDArray[np.int64]:
        """Play a little, prove what is left, and play all on what is not proven; the rows of the core."""
        group = slice(first, first + GROUP)
        some, own, same = found[group], killed[group], proven[group]
        made = library(case.pins, flat, some)
        run(made, own, n_outputs, played.pins[: len(played.pins) // _LITTLE])
        with tempfile.TemporaryDirectory() as folder:
            same[own < 0] = alike(case, flat, [some[number] for number in np.flatnonzero(own < 0)], Path(folder))
        own[same] = 0
        return run(made, own, n_outputs, played.pins, 0 if first or not played.traces else len(played.pins))

    rows, *_ = pool.map(judged, range(0, len(found), GROUP))
    with patch("tachometry.spec.methods.s.MAX_TABLE", case.max_table):
        hold(case, played, rows)
    left = [found[number] for number in np.flatnonzero(killed < 0)]
    more = [False] * len(left)
    if not isinstance(case.spec, TrackTachometer):  # whose program no solver can follow
        with tempfile.TemporaryDirectory() as folder:
            more = equivalent(case, flat, left, played.pins, Path(folder), pool)
    left = [mutant for mutant, same in zip(left, more, strict=True) if not same]
    survivors = [mutant for mutant in left if not argued(case.name, mutant)]
    n_proven = int(proven.sum())
    n_killed = int((killed >= 0).sum()) - n_proven
    return Score(case, len(found), n_killed, n_proven + sum(more), len(left) - len(survivors), survivors)


def hold(case: Case, played: Stimulus, rows: NDArray[np.int64]) -> None:
    """Hold the core without a mutant against the golden model, from reset to reset."""
    for trace, start in zip(played.traces, played.starts, strict=True):
        own = rows[(rows[:, 0] >= start) & (rows[:, 0] < start + trace.n_clocks)]
        own[:, 0] -= start
        count, first = compare(case.right(trace), observed(case.spec, trace.n_clocks, own))
        assert count == 0, f"{case.name}, from clock {start}: {first[0]}"
