"""Silence, first counts and dithering, for every method: what a user sees at the ports."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from independent.bench import Row, in_icarus
from independent.cases import Case
from independent.settings import Settings
from independent.stimulus import Lines, steady
from independent.test_cores import made

TICK, MOST = 50, 10
WORDS = {"ppr": "500", "clock": "1000000Hz", "tick": str(TICK), "max-time": str(TICK * MOST)}
METHODS: dict[str, dict[str, str]] = {"s": {}, "m": {}, "t": {}, "mt": {}, "rairan": {}, "mt tick": {"timer": "tick"}}
Generated = Callable[..., Path]


def rows_of(generated: Generated, method: str, lines: Lines, **more: str) -> list[Row]:
    """What a core with ticks of 50 clocks shows."""
    case = Case("core", Settings(method.split()[0], {**WORDS, **METHODS[method], **more}), lines.n_clocks)
    folder, manifest = made(generated, case)
    return in_icarus(folder, manifest, lines.play())


@pytest.mark.parametrize("method", METHODS)
def test_silence_and_dithering(method: str, generated: Generated) -> None:
    """`stalled` rises after the maximum time and falls with a count; dithering on one edge reads 0."""
    first, single, last, dithers = 16 * TICK + 7, 50 * TICK + 9, 66 * TICK + 5, 110 * TICK + 3
    edges = [*steady(first, 31, 12), (single, 1), *steady(last, 47, 20)]
    gaps = [37] * 6 + [50] * 6 + [111] * 6 + [173] * 6
    edges += [(dithers + sum(gaps[:nth]), 1 - 2 * (nth % 2)) for nth in range(len(gaps))]
    rows = rows_of(generated, method, Lines(dithers + sum(gaps), 0, edges))
    empty, counted, seen = 0, False, {0: 0, 1: 0}
    for row in rows:
        if not row["tick"] or row["clock"] > dithers:
            continue
        was_counted, counted = counted, row["pulse_count"] != 0
        empty = 0 if counted else empty + 1
        # Seen at the end of a tick; the change may be a tick late.
        if empty >= MOST + 2:
            assert row["stalled"], (method, row)
        elif empty < MOST and (was_counted or empty > 1):
            assert not row["stalled"], (method, row)
        seen[row["stalled"]] += 1
    assert min(seen.values()) > 8
    after = [row["velocity"] for row in rows if row["velocity_valid"] and row["clock"] > dithers]
    assert method in ("s", "m") or not any(after)


@pytest.mark.parametrize("before", [0, 3 * MOST * TICK])
def test_the_first_count_of_rairan_only_opens_a_window(before: int, generated: Generated) -> None:
    """After reset, and after a rest: a speed is only shown when a second count has come, and is right."""
    start = 17 if before else 0
    edges = steady(start, 130, 3) if before else []
    once = start + 390 + before if before else 150
    edges += [(once, 1), (once + 130, 1), (once + 260, 1)]
    rows = rows_of(generated, "rairan", Lines(once + 300, 0, edges))
    after = [row for row in rows if row["velocity_valid"] and row["clock"] > once - 20]
    early = [row["velocity"] for row in after if row["clock"] < once + 130]
    assert not any(early)
    # Two whole dt from count to count: n3 = 2/5 of a count per dt.
    shown = [row["velocity"] for row in after if row["clock"] > once + 130 and not row["forced"]]
    assert shown[0] == round(Fraction(2, 5) * 65536)


@pytest.mark.parametrize(("line", "length"), [(0, 1), (1, 4)])
def test_the_filter_keeps_out_a_glitch_in_the_first_samples(line: int, length: int, generated: Generated) -> None:
    lines = Lines(6 * TICK, 0, [], [(0, line, length)])
    rows = rows_of(generated, "m", lines, filter="5")
    assert {row["position"] for row in rows} == {0}
    assert not any(row["decode_error"] for row in rows)
