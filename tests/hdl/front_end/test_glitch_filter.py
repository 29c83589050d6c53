import itertools

import numpy as np
import pytest
from reference.front import believed
from support.nightly import nightly, only
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
    """Return what is believed in the clock after each, and how many levels went back.

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


@pytest.mark.parametrize("clocks", [1, 4])
@pytest.mark.parametrize("level", [0, 1])
def test_the_first_level_is_believed_after_as_many_clocks_as_any(clocks: int, level: int) -> None:
    rows = [{"a": level, "b": level}] * 12
    seen = clock_by_clock(
        InputConditioner(clocks), rows, ["level_a", "level_b", "ready_a", "ready_b", "swallowed_edges"]
    )
    for name in ("ready_a", "ready_b"):
        assert [row[name] for row in seen] == [0] * (3 + clocks) + [1] * (9 - clocks)
    assert all((row["level_a"], row["level_b"], row["swallowed_edges"]) == (level, level, 0) for row in seen[3:])


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
        assert not run.ticks["swallowed_edges"].any()


def test_swallowed_edges_of_both_lines_are_counted() -> None:
    rows = [{"a": 0, "b": 0}] * 4 + [{"a": 1, "b": 1}, {"a": 0, "b": 0}, {}, {"a": 1}, {"a": 0}] + [{}] * 5
    seen = clock_by_clock(InputConditioner(3), rows, ["swallowed_edges"])
    assert seen[-1]["swallowed_edges"] == 6


@nightly  # it counts to its end, edge by edge
def test_the_count_of_swallowed_edges_stays_at_its_end() -> None:
    dithering = [{"a": 0, "b": 0}] * 4 + [{"a": k & 1, "b": k & 1} for k in range(2 * 16400)]
    assert clock_by_clock(InputConditioner(2), dithering, ["swallowed_edges"])[-1]["swallowed_edges"] == 65534


def test_bad_clocks() -> None:
    with pytest.raises(ValueError, match=r"^clocks must be at least 1, not 0$"):
        GlitchFilter(0)


def test_a_level_is_out_after_the_synchroniser() -> None:
    seen = clock_by_clock(
        InputConditioner(), [{"a": 0, "b": 1}] * 4 + [{"a": 1}] + [{}] * 4, ["level_a", "level_b", "ready_a", "ready_b"]
    )
    latency = 2
    assert [row["level_a"] for row in seen] == [0] * (4 + latency) + [1] * (5 - latency)
    assert [row["level_b"] for row in seen] == [0] * latency + [1] * (9 - latency)


@pytest.mark.parametrize(("a", "b"), list(itertools.product((0, 1), repeat=2)))
def test_ready_only_when_the_level_and_the_one_before_are_real(a: int, b: int) -> None:
    seen = clock_by_clock(InputConditioner(), [{"a": a, "b": b}] * 8, ["level_a", "level_b", "ready_a", "ready_b"])
    assert [(row["ready_a"], row["ready_b"]) for row in seen] == [(0, 0)] * 3 + [(1, 1)] * 5
    assert all((row["level_a"], row["level_b"]) == (a, b) for row in seen[2:])
