"""Cores of many axes, compiled, against their golden model; what is asked of their runs."""

import csv
from pathlib import Path

import numpy as np
import pytest
from support.nightly import nightly

from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress_of
from tachometry.sim.engines.compiled import CompiledEngine
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.signals.axes import AxesTrace, of_axis
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.tables import write_counts, write_trace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.sim.studies.pairs import AXES, core_of
from tachometry.spec import AxesSpec


def axes_of(number: int) -> AxesSpec:
    spec = core_of(AXES[number])
    assert isinstance(spec, AxesSpec)
    return spec


def check(number: int, engine: CompiledEngine, motions: int) -> None:
    spec = axes_of(number)
    for seed in range(1, 1 + motions):
        found = lockstep(spec, stress_of(spec, seed, 100), engine)
        assert found.n_mismatches == 0, f"seed {seed}: {found.first}"
    for axis in range(spec.axes):
        run = of_axis(spec, found.actual, axis)
        assert np.count_nonzero(~run.updates.forced) > 30
        assert np.count_nonzero(run.updates.forced)
        assert bool(len(run.index)) == (spec.axis.index is not None)
    assert len(found.actual.errors)


def test_sixty_four_axes() -> None:
    check(4, Cxxrtl(), 1)


@nightly
def test_no_memory_of_five_tracked_axes_is_read_behind_its_end() -> None:
    """Compiled, that would end the process."""
    words = next(words for words in AXES if words[1] == "track" and "5" in words)
    spec = core_of(words)
    assert isinstance(spec, AxesSpec)
    assert spec.slots == 5
    assert lockstep(spec, stress_of(spec, 1, 5), Cxxrtl()).n_mismatches == 0


def test_tables_of_an_axis_are_those_of_a_core_of_its_own(tmp_path: Path) -> None:
    spec = axes_of(1)
    trace = stress_of(spec, 1, 20)
    assert isinstance(trace, AxesTrace)
    run = golden.run(spec, trace)
    write_trace(tmp_path / "updates.csv", spec, run)
    write_counts(tmp_path / "counts.csv", run)
    updates, counts = (
        list(csv.DictReader((tmp_path / name).read_text().splitlines())) for name in ("updates.csv", "counts.csv")
    )
    assert [int(row["clock"]) for row in updates] == run.updates.clock.tolist()
    assert [int(row["tick"]) for row in counts] == [row // spec.axes for row in range(len(run.ticks))]
    for axis in range(spec.axes):
        own = of_axis(spec, run, axis)
        rows = [row for row in updates if row["axis"] == str(axis)]
        assert [int(row["velocity_raw"]) for row in rows] == own.updates.velocity.tolist()
        assert [int(row["tick"]) for row in rows] == np.searchsorted(own.ticks.clock, own.updates.clock).tolist()


def test_traces_of_axes_end_together_and_have_the_same_lines() -> None:
    low = np.zeros(1, dtype=np.uint8)
    short, long = (PinTrace(np.zeros(1, dtype=np.int64), low, low, n) for n in (10, 20))
    assert AxesTrace.of([short, long]).n_clocks == 20
    with pytest.raises(ValueError, match="must have the same lines, and as many clocks"):
        AxesTrace((short, long))
    with pytest.raises(ValueError, match="must have the same lines, and as many clocks"):
        AxesTrace((short, PinTrace(short.clock, low, low, 10, low)))


def test_levels_of_a_capture() -> None:
    """A row of bytes, the lines of axis 0 first."""
    low_high, low = np.array([0, 1], dtype=np.uint8), np.zeros(2, dtype=np.uint8)
    each = [PinTrace(np.arange(2), low_high, low_high if axis % 2 else low, 9) for axis in range(6)]
    trace = AxesTrace(tuple(each))
    assert trace.names[:3] == [(0, "a"), (0, "b"), (1, "a")]
    assert trace.levels.tolist() == [[0, 0], [0b11011101, 0b1101]]
