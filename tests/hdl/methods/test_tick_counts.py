"""The counts of a tick, with injected steps: number, times and places, held against sums over a list."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.methods import tick_counts
from tachometry.spec.formats.tracking import Tracking

MAX_TICKS, MAX_COUNT, T = 5, 6, 20
FORM = Tracking(
    clock_hz=1_000_000,
    tick_cycles=T,
    longest_tick=T,
    max_ticks=MAX_TICKS,
    max_count=MAX_COUNT,
    external=False,
    bandwidth=Fraction(1000),
    least_memory=Fraction(7, 10),
    edge_error=Fraction(2, 5),
    agile=True,
    growing=True,
    velocity_bits=8,
    fine_bits=4,
)
Row = tuple[int, int, int, int, bool]  # number, times, places, elapsed, quiet
SHOWN = ["number", "times", "places", "elapsed", "quiet", "counted", "length"]


def expected(counts: Mapping[int, int], lengths: list[int], tracks: list[bool]) -> list[Row]:
    """Return what the counts are after each tick; `counts` has the steps by their clocks, `tracks` what is known in a
    tick.
    """
    rows: list[Row] = []
    begin, silent = 0, MAX_TICKS
    alone = True  # only the last count of a tick is used
    for i, length in enumerate(lengths):
        own = [(clock, step) for clock, step in sorted(counts.items()) if begin <= clock < begin + length]
        begin += length
        elapsed = min(silent + 1, MAX_TICKS)
        silent = 0 if own else elapsed
        used = own[-1:] if alone or len(own) > MAX_COUNT else own
        # Half a count before or behind its edge, from where the tick ends.
        place = [2 * (0 - sum(step for clock, step in own if clock > now)) - way for now, way in used]
        rows.append((len(used), sum(begin - 1 - now for now, _ in used), sum(place), elapsed, elapsed == MAX_TICKS))
        alone = not own or not tracks[i]
    return rows


def run(
    form: Tracking, counts: Mapping[int, int], lengths: list[int], tracks: list[bool] | None = None
) -> list[dict[str, int]]:
    """Return what is shown two clocks after each tick, and until the next; `tracks` is that of the clock after each."""
    tracks = tracks or [True] * len(lengths)
    ends = (np.cumsum(lengths) - 1).tolist()
    rows = [{"tick": 0, "step": counts.get(clock, 0), "tracks": 1} for clock in range(ends[-1] + 3)]
    for end, known in zip(ends, tracks, strict=True):
        rows[end]["tick"] = 1
        rows[end + 1]["tracks"] = known
    seen = clock_by_clock(tick_counts.TickCounts(form, MAX_TICKS), rows, SHOWN)
    for end, following in zip(ends, [*ends[1:], ends[-1] + 1], strict=True):
        assert all(row["number"] == seen[end + 2]["number"] for row in seen[end + 2 : following + 2])
    return [seen[end + 2] for end in ends]


def check(
    counts: Mapping[int, int],
    lengths: list[int],
    tracks: list[bool] | None = None,
    form: Tracking = FORM,
) -> None:
    """All of it is as expected."""
    seen = run(form, counts, lengths, tracks)
    got = [(row["number"], row["times"], row["places"], row["elapsed"], bool(row["quiet"])) for row in seen]
    assert got == expected(counts, lengths, tracks or [True] * len(lengths))
    assert [row["counted"] for row in seen] == [int(row["number"] > 0) for row in seen]


def begun(*counts: tuple[int, int]) -> dict[int, int]:
    """Return counts of the third tick, behind two with one each, so that all of them are used."""
    return {3: 1, T + 3: 1} | {2 * T + clock: step for clock, step in counts}


def test_times() -> None:
    """A count in the last clock of a tick has time 0, and the next clock belongs to the next tick."""
    for clock in range(T):
        row = run(FORM, begun((clock, 1)), [T] * 3)[2]
        assert (row["number"], row["times"], row["places"]) == (1, T - 1 - clock, -1)
    rows = run(FORM, begun((0, 1), (7, 1), (19, 1), (20, 1)), [T] * 4)
    assert [(row["number"], row["times"]) for row in rows[2:]] == [(3, 19 + 12), (1, 19)]


def test_places() -> None:
    """In half counts: forward the last is −1, the one before −3; backward 1 and 3."""
    for step in (1, -1):
        rows = [run(FORM, begun(*((2 * k, step) for k in range(n))), [T] * 3)[2] for n in range(1, MAX_COUNT + 1)]
        assert [row["places"] for row in rows] == [-step * n * n for n in range(1, MAX_COUNT + 1)]


def test_turning() -> None:
    """Counts that cancel: an edge that is met twice has the same place both times, and both are counts."""
    row = run(FORM, begun((4, 1), (9, -1)), [T] * 3)[2]
    assert (row["number"], row["times"], row["places"]) == (2, 15 + 10, 2)
    check(begun((4, -1), (9, 1), (11, 1), (12, -1)), [T] * 3)


def test_more_than_max_count() -> None:
    """Of more than `max_count` only the last is used, and the tick after it is as any other."""
    for extra in range(1, 5):
        crowd = begun(*((k, 1) for k in range(MAX_COUNT + extra)), (T + 5, -1), (T + 9, -1))
        check(crowd, [T] * 4)
        assert run(FORM, crowd, [T] * 4)[2]["number"] == 1
    # The clock after a full tick begins the next one, which is not too full.
    check(begun(*((T - k, 1) for k in range(1, MAX_COUNT + 1)), (T, 1), (T + 1, 1)), [T] * 4)


def test_alone() -> None:
    """Behind an empty tick, and without a speed, only the last count of a tick is used."""
    counts = {3: 1, 2 * T + 3: 1, 2 * T + 8: 1, 3 * T + 3: 1, 3 * T + 8: 1}
    for tracks in ([True] * 4, [False] * 4, [True, True, False, True]):
        check(counts, [T] * 4, tracks)
    assert [row["number"] for row in run(FORM, counts, [T] * 4)] == [1, 0, 1, 2]


def test_silence() -> None:
    """Ticks since the last one with counts, until they are `max_ticks`; so at first."""
    counts = {T + 3: 1, 4 * T + 3: 1, 5 * T: -1, 12 * T: 1}
    seen = run(FORM, counts, [T] * 14)
    assert [row["elapsed"] for row in seen] == [5, 5, 1, 2, 3, 1, 1, 2, 3, 4, 5, 5, 5, 1]
    assert [row["counted"] for row in seen] == [0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0, 1, 0]
    check(counts, [T] * 14)


def test_external() -> None:
    """Ticks of other lengths."""
    form = replace(FORM, external=True, longest_tick=2 * T)
    lengths = [T, 7, 2 * T, 12, 39, 2]
    seen = run(form, {3: 1, 30: 1, 60: -1, 61: -1, 80: 1}, lengths)
    assert [row["length"] for row in seen] == lengths
    check({3: 1, 30: 1, 60: -1, 61: -1, 80: 1}, lengths, form=form)


# Odd seeds have external ticks; each has 40 stretches of other counts.
@pytest.mark.parametrize("seed", only(range(4), range(20)))
def test_random_counts(seed: int) -> None:
    rng = np.random.default_rng(seed)
    external = bool(seed % 2)
    lengths = rng.integers(2, 2 * T + 1, 200).tolist() if external else [T] * 200
    form = replace(FORM, external=external, longest_tick=2 * T if external else T)
    dense = np.repeat(rng.choice([0, 0.03, 0.2, 0.5, 1], 40), sum(lengths) // 40 + 1)[: sum(lengths)]
    way = np.repeat(rng.choice([0.0, 0.5, 1.0], 40), sum(lengths) // 40 + 1)[: sum(lengths)]
    at = np.flatnonzero(rng.random(len(dense)) < dense)
    steps = np.where(rng.random(len(at)) < way[at], 1, -1)
    tracks = (rng.random(len(lengths)) < 0.9).tolist()
    check(dict(zip(at.tolist(), steps.tolist(), strict=True)), lengths, tracks, form)
