"""The counts of a tick, with injected steps: held against sums over a list, as are those of the golden model."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.methods import tick_counts
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.track import Windows
from tachometry.spec.formats.tracking import Tracking

MAX_TICKS, MOST, T = 5, 7, 20
FORM = Tracking(
    clock_hz=1_000_000,
    tick_cycles=T,
    longest_tick=T,
    external=False,
    max_count=MOST,
    counts_per_rev=400,
    max_memory=None,
    max_time=MAX_TICKS * T,
    velocity_out=8,
    slope=Fraction(1, 2),
    velocity_std=Fraction(T),
    std_bits=8,
)
NAMES = ["number", "times", "places", "last", "moved", "kind", "down", "end", "length"]


def expected(counts: Mapping[int, int], lengths: list[int]) -> list[dict[str, int]]:
    """Return what the counts are after each tick; `counts` has the steps by their clocks."""
    rows, begin, silent, position = [], 0, MAX_TICKS, 0
    for length in lengths:
        own = [(clock, step) for clock, step in sorted(counts.items()) if begin <= clock < begin + length]
        begin += length
        silent = min(silent + 1, MAX_TICKS)
        used, at, places = own[:MOST], position, 0
        for clock, step in own:
            if (clock, step) in used:
                lower = min(at, at + step)
                places += 2 * (lower - position) + 1
                kind, down = lower % 4, step < 0
            at += step
        rows.append({"number": len(used), "times": sum(begin - 1 - now for now, _ in used), "places": places})
        rows[-1] |= {"moved": at - position, "end": at % 4, "length": length, "elapsed": silent}
        if own:
            rows[-1] |= {"last": begin - 1 - own[-1][0], "kind": kind, "down": int(down)}
            silent = 0
        position = at
    return rows


def run(form: Tracking, counts: Mapping[int, int], lengths: list[int]) -> list[dict[str, int]]:
    """Return the outputs two clocks after each tick, and until the next ends."""
    ends = (np.cumsum(lengths) - 1).tolist()
    rows = [{"tick": 0, "step": counts.get(clock, 0)} for clock in range(ends[-1] + 3)]
    for end in ends:
        rows[end]["tick"] = 1
    seen = clock_by_clock(tick_counts.TickCounts(form, MAX_TICKS), rows, [*NAMES, "elapsed"])
    for end, following in zip(ends, [*ends[1:], ends[-1] + 1], strict=True):
        held = [name for name in [*NAMES, "elapsed"] if name != "length"]
        assert all(row[name] == seen[end + 2][name] for row in seen[end + 2 : following + 1] for name in held)
    return [seen[end + 2] for end in ends]


def check(counts: Mapping[int, int], lengths: list[int], form: Tracking = FORM) -> list[dict[str, int]]:
    """Hold gates and golden model against the sums; what the gates show."""
    seen, right = run(form, counts, lengths), expected(counts, lengths)
    clock = np.array(sorted(counts), dtype=np.int64)
    none = np.empty(0, dtype=np.int64)
    steps = Steps(clock, np.array([counts[at] for at in clock.tolist()]), none, none, none)
    windows = Windows.of(steps, np.cumsum(lengths) - 1, form.most_number)
    golden = [dict(zip(NAMES, map(int, row), strict=True)) for row in windows.rows()]
    for got, model, row in zip(seen, golden, right, strict=True):
        assert {name: got[name] for name in row} == row
        assert model == {name: row.get(name, 0) for name in NAMES}
    return seen


def third(*counts: tuple[int, int]) -> dict[str, int]:
    """Return the outputs for these counts of the third tick, behind two with one each."""
    return check({3: 1, T + 3: 1} | {2 * T + clock: step for clock, step in counts}, [T] * 4)[2]


# Odd seeds have external ticks; each has 40 stretches of other counts.
@pytest.mark.parametrize("seed", only(range(2), range(20)))
def test_random_counts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    external = bool(seed % 2)
    lengths = rng.integers(2, 2 * T + 1, 150).tolist() if external else [T] * 150
    form = replace(FORM, external=external, longest_tick=2 * T if external else T)
    dense = np.repeat(rng.choice([0, 0.03, 0.2, 0.5, 1], 40), sum(lengths) // 40 + 1)[: sum(lengths)]
    way = np.repeat(rng.choice([0.0, 0.5, 1.0], 40), sum(lengths) // 40 + 1)[: sum(lengths)]
    at = np.flatnonzero(rng.random(len(dense)) < dense)
    steps = np.where(rng.random(len(at)) < way[at], 1, -1)
    check(dict(zip(at.tolist(), steps.tolist(), strict=True)), lengths, form)
