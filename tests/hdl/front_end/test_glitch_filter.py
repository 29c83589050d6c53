import itertools

import numpy as np
import pytest
from reference.front import believed
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.conditioner import InputConditioner
from tachometry.hdl.front_end.glitch_filter import GlitchFilter
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.golden.front_end import filter_line
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.index import Index


def definition(levels: list[int], clocks: int) -> tuple[list[int], int]:
    """Return the level believed in the clock after each, and how many levels went back.

    −1 stands for nothing: no level has held long enough yet.
    """
    changes = [(clock, level) for clock, level in enumerate(levels) if not clock or level != levels[clock - 1]]
    passed, gone = believed(changes, len(levels), clocks)
    shown = [-1]
    for clock in range(len(levels)):
        shown.append(passed.get(clock + 1 - clocks, shown[-1]))
    return shown[1:], len(gone)


def random_levels(seed: int) -> list[int]:
    rng = np.random.default_rng(seed)
    runs = rng.integers(1, 8, size=200)
    return [int(k % 2) for k, run in enumerate(runs) for _ in range(run)]


@pytest.mark.parametrize("clocks", [1, 2, 3, 7, 8])
@pytest.mark.parametrize("seed", range(3))
def test_random_levels_against_the_definition(clocks: int, seed: int) -> None:
    levels = random_levels(seed)
    rows = [{"valid": 0, "level": 1 - levels[0]}] * 2 + [{"valid": 1, "level": level} for level in levels]
    seen = clock_by_clock(GlitchFilter(clocks), [*rows, {}], ["filtered", "known", "swallowed"])
    shown, gone = definition(levels, clocks)
    assert [row["filtered"] if row["known"] else -1 for row in seen[3:]] == shown, seed
    assert sum(row["swallowed"] for row in seen[:-1]) == gone, seed


@pytest.mark.parametrize("clocks", [1, 2, 3, 7, 8])
@pytest.mark.parametrize("seed", range(10))
def test_golden_filter_against_the_definition(clocks: int, seed: int) -> None:
    levels = np.array(random_levels(seed), dtype=np.uint8)
    changes = np.flatnonzero(np.diff(levels, prepend=1 - levels[0]))
    at, level, returned = filter_line(changes, levels[changes], clocks)
    shown, gone = definition(levels.tolist(), clocks)
    # What holds from clock c on is believed after clock c + clocks − 1.
    level = np.append(-1, level.astype(int))
    found = [int(level[np.searchsorted(at + clocks, c + 1, side="right")]) for c in range(len(levels))]
    assert (found, len(returned)) == (shown, gone), seed


def test_a_filter_of_many_clocks() -> None:
    levels = [k % 2 for k, run in enumerate([299, 1, 298, 300, 299, 301, 2, 600]) for _ in range(run)]
    rows = [{"valid": 1, "level": level} for level in levels]
    seen = clock_by_clock(GlitchFilter(300), [*rows, {}], ["filtered", "known", "swallowed"])
    shown, gone = definition(levels, 300)
    assert [row["filtered"] if row["known"] else -1 for row in seen[1:]] == shown
    assert sum(row["swallowed"] for row in seen[:-1]) == gone


@pytest.mark.parametrize("line", only(["z"], ["a", "b", "z"]))  # all lines have the same filter
def test_the_first_samples_are_filtered(line: str) -> None:
    """Neither a step nor an error comes of what rattles at first, whatever level the lines rest at."""
    rattles = [[1], [0, 1], [1, 1, 1, 1], [0, 0, 0, 0, 1], [1, 0, 1, 1, 0, 0, 0, 0, 1, 0, 1]]
    spec = STachometer(
        encoder=Encoder(25),
        timing=Timing(1_000_000, 4, 3),
        filter_clocks=5,
        index=Index(),
        position_width=8,
        frac_bits=4,
    )
    for rest, rattle in itertools.product((0, 1), rattles):
        lines = {name: np.full(60, rest, dtype=np.uint8) for name in ("a", "b", "z")}
        lines[line][: len(rattle)] = rest ^ np.array(rattle, dtype=np.uint8)
        lines["a"][40:] ^= 1  # a real one
        found = lockstep(spec, PinTrace.of_lines(np.arange(60), 60, lines), PySim())
        assert found.n_mismatches == 0, found.first
        run = found.actual
        assert np.abs(run.ticks.position).tolist() == [0] * 11 + [1] * 3
        assert len(run.errors) == len(run.index) == 0
        assert not run.ticks["filtered_edges"].any()


def test_swallowed_edges_of_both_lines_are_counted() -> None:
    rows = [{"a": 0, "b": 0}] * 4 + [{"a": 1, "b": 1}, {"a": 0, "b": 0}, {}, {"a": 1}, {"a": 0}] + [{}] * 5
    seen = clock_by_clock(InputConditioner(3), rows, ["filtered_edges"])
    assert seen[-1]["filtered_edges"] == 6


def test_bad_clocks() -> None:
    with pytest.raises(ValueError, match=r"^clocks must be at least 1, not 0$"):
        GlitchFilter(0)
