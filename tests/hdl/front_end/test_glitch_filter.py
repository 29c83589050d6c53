import numpy as np
import pytest
from support.mutant import caught, mutant
from support.simulate import clock_by_clock

from tachometry.hdl.front_end.conditioner import InputConditioner
from tachometry.hdl.front_end.glitch_filter import GlitchFilter
from tachometry.sim.golden.front_end import filter_line


def definition(levels: list[int], clocks: int) -> tuple[list[int], int]:
    """Clock by clock, in plain words: what is believed in the clock after each, and how many levels went back."""
    believed, held, gone = levels[0], 0, 0
    shown = []
    for level in levels:
        if level == believed:
            gone += held > 0
            held = 0
        else:
            held += 1
            if held == clocks:
                believed, held = level, 0
        shown.append(believed)
    return shown, gone


def random_levels(seed: int) -> list[int]:
    rng = np.random.default_rng(seed)
    runs = rng.integers(1, 8, size=200)
    return [int(k % 2) for k, run in enumerate(runs) for _ in range(run)]


def check_definition(clocks: int, seed: int) -> None:
    levels = random_levels(seed)
    rows = [{"load": 1, "level": levels[0]}] + [{"load": 0, "level": level} for level in levels]
    seen = clock_by_clock(GlitchFilter(clocks), [*rows, {}], ["filtered", "swallowed"])
    shown, gone = definition(levels, clocks)
    assert [row["filtered"] for row in seen[2:]] == shown, seed
    assert sum(row["swallowed"] for row in seen[:-1]) == gone, seed


@pytest.mark.parametrize("clocks", [1, 2, 3, 7, 8])
@pytest.mark.parametrize("seed", range(3))
def test_random_levels_against_the_definition(clocks: int, seed: int) -> None:
    check_definition(clocks, seed)


@pytest.mark.parametrize("clocks", [1, 2, 3, 7, 8])
@pytest.mark.parametrize("seed", range(10))
def test_golden_filter_against_the_definition(clocks: int, seed: int) -> None:
    levels = np.array(random_levels(seed), dtype=np.uint8)
    changes = np.flatnonzero(np.diff(levels, prepend=1 - levels[0]))
    at, level, returned = filter_line(changes, levels[changes], clocks)
    shown, gone = definition(levels.tolist(), clocks)
    # What holds from clock c on is believed after clock c + clocks − 1.
    found = [int(level[np.searchsorted(at + clocks * (at > 0), c + 1, side="right") - 1]) for c in range(len(levels))]
    assert (found, len(returned)) == (shown, gone), seed


@pytest.mark.parametrize("clocks", [1, 4])
@pytest.mark.parametrize("level", [0, 1])
def test_the_first_level_is_believed_at_once(clocks: int, level: int) -> None:
    rows = [{"a": level, "b": level}] * 9
    seen = clock_by_clock(InputConditioner(clocks), rows, ["level_a", "level_b", "ready", "swallowed_edges"])
    assert [row["ready"] for row in seen] == [0] * 4 + [1] * 5
    assert all((row["level_a"], row["level_b"], row["swallowed_edges"]) == (level, level, 0) for row in seen[3:])


def test_swallowed_edges_of_both_lines_are_counted() -> None:
    rows = [{"a": 0, "b": 0}] * 4 + [{"a": 1, "b": 1}, {"a": 0, "b": 0}, {}, {"a": 1}, {"a": 0}] + [{}] * 5
    seen = clock_by_clock(InputConditioner(3), rows, ["swallowed_edges"])
    assert seen[-1]["swallowed_edges"] == 6


def test_the_count_of_swallowed_edges_stays_at_its_end() -> None:
    dithering = [{"a": k & 1, "b": k & 1} for k in range(2 * 16400)]
    assert clock_by_clock(InputConditioner(2), dithering, ["swallowed_edges"])[-1]["swallowed_edges"] == 65534


def test_mutant_that_believes_a_clock_early_is_caught() -> None:
    with mutant(GlitchFilter, "held == self._clocks - 1", "held == self._clocks - 2"), caught():
        check_definition(3, seed=0)


def test_bad_clocks() -> None:
    with pytest.raises(ValueError, match=r"^clocks must be at least 1, not 0$"):
        GlitchFilter(0)
