"""What becomes of the mutants of a core."""

import tempfile
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

from mutation.cases import Case
from mutation.netlist import GROUP, Mutant, exported, mutants
from mutation.simulate import Deaths, library, run
from mutation.stimulus import Stimulus, stimulus
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.results import compare, observed

CLOCKS = 300_000  # of the stimulus


@dataclass(frozen=True)
class Score:
    """Of a core: numbers of mutants, and those that are neither killed nor known to be equivalent."""

    case: Case
    mutants: int
    killed: int
    equivalent: int
    survivors: list[Mutant]


def judge(case: Case, pool: Executor, played: Stimulus | None = None) -> Score:
    """Play a stimulus on all mutants of a core, that of `CLOCKS` clocks if none is given.

    Raises
    ------
    AssertionError
        If the core without a mutant differs from the golden model.
    """
    spec = case.spec
    played = played or stimulus(spec, CLOCKS)
    n_outputs = sum(port.direction == "output" for port in spec.ports)
    with tempfile.TemporaryDirectory() as folder, patch("tachometry.spec.s_method.MAX_TABLE", case.max_table):
        flat, found = mutants(exported(spec), case.mutants, Path(folder))

    def group(first: int) -> Deaths:
        some = found[first : first + GROUP]
        rows = 0 if first else len(played.pins)
        return run(library(spec, flat, some), len(some), n_outputs, played.pins, rows)

    deaths = list(pool.map(group, range(0, len(found), GROUP)))
    with patch("tachometry.spec.s_method.MAX_TABLE", case.max_table):
        _hold(case, played, deaths[0].rows)
    killed = [clock >= 0 for group in deaths for clock in group.killed]
    survivors = [mutant for mutant, dead in zip(found, killed, strict=True) if not dead]
    return Score(case, len(found), sum(killed), 0, survivors)


def _hold(case: Case, played: Stimulus, rows: NDArray) -> None:
    """Hold the core without a mutant against the golden model, from reset to reset."""
    for trace, start in zip(played.traces, played.starts, strict=True):
        own = rows[(rows[:, 0] >= start) & (rows[:, 0] < start + trace.n_clocks)]
        own[:, 0] -= start
        count, first = compare(golden.run(case.spec, trace), observed(case.spec, trace.n_clocks, own))
        assert count == 0, f"{case.name}, from clock {start}: {first[0]}"
