"""Silence, first counts and dithering, for every method: what a user sees at the ports."""

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from independent.bench import Row, in_icarus
from independent.cases import SILENT, Case, parameters
from independent.stimulus import Lines, steady
from independent.test_cores import check_core, made
from reference.settings import Settings

TICK, MOST = 50, 10
Generated = Callable[..., Path]


@pytest.mark.parametrize("case", parameters(SILENT, nightly=("track_native", "m_native", "t_native", "mt_native")))
def test_core_and_its_silences(case: Case, generated: Generated) -> None:
    folder, manifest = made(generated, case)
    check_core(case, folder, manifest)

    def rows_of(lines: Lines) -> list[Row]:
        return in_icarus(folder, manifest, lines.play())

    check_silence_and_dithering(case.settings, rows_of)
    if case.settings.method == "rairan":
        for before in (0, 3 * MOST * TICK):
            check_first_count(before, rows_of)


def check_silence_and_dithering(settings: Settings, rows_of: Callable[[Lines], list[Row]]) -> None:
    """`standstill` rises after the maximum time and falls with a count; dithering on one edge reads 0."""
    tick, more = settings.tick, settings.tick // TICK
    assert (tick, settings.max_ticks) == (TICK * more, MOST)
    first, single, last, dithers = 16 * tick + 7, 50 * tick + 9, 66 * tick + 5, 110 * tick + 3
    if settings.method == "track":  # it forgets after 100 ms
        dithers += settings.clock_hz // 10
    edges = [*steady(first, 31 * more, 12), (single, 1), *steady(last, 47 * more, 20)]
    gaps = [37 * more] * 6 + [50 * more] * 6 + [111 * more] * 6 + [173 * more] * 6
    edges += [(dithers + sum(gaps[:nth]), 1 - 2 * (nth % 2)) for nth in range(len(gaps))]
    end = dithers + sum(gaps)
    ticks = [(at, 3, 1) for at in range(tick - 3, end, tick)] if settings.external else []
    rows = rows_of(Lines(end, 0, edges, pulses=ticks))
    # What was before reset is empty; tracking measures from reset on, and shows what it finds with the velocity.
    tracks, seen = settings.method == "track", {0: 0, 1: 0}
    empty = 0 if tracks else 1
    for row in rows:
        if not row["velocity_valid" if tracks else "tick"] or row["clock"] > dithers:
            continue
        empty = 0 if row["pulse_count"] else empty + 1
        assert row["standstill"] == (empty > MOST - tracks), row
        assert not (tracks and row["standstill"] and row["velocity"]) or settings.lowpass, row
        seen[row["standstill"]] += 1
    assert min(seen.values()) > 8
    after = [row["velocity"] for row in rows if row["velocity_valid"] and row["clock"] > dithers]
    # Of two counts in a tick tracking knows the mean place to 0.2 %.
    most = settings.lsb_per_count / 1000 if settings.method == "track" else 0
    assert settings.method in ("s", "m") or max(map(abs, after)) <= most


def check_first_count(before: int, rows_of: Callable[[Lines], list[Row]]) -> None:
    """After reset, and after a rest: Rairán shows a speed only when a second count has come, and it is right."""
    start = 17 if before else 0
    edges = steady(start, 130, 3) if before else []
    once = start + 390 + before if before else 150
    edges += [(once, 1), (once + 130, 1), (once + 260, 1)]
    rows = rows_of(Lines(once + 300, 0, edges))
    after = [row for row in rows if row["velocity_valid"] and row["clock"] > once - 20]
    early = [row["velocity"] for row in after if row["clock"] < once + 130]
    assert not any(early)
    # Two whole dt from count to count: n3 = 2/5 of a count per dt.
    shown = [row["velocity"] for row in after if row["clock"] > once + 130 and not row["forced"]]
    assert shown[0] == round(Fraction(2, 5) * 65536)


def test_the_filter_keeps_out_a_glitch_in_the_first_samples(generated: Generated) -> None:
    words = {"ppr": "500", "clock": "1000000Hz", "tick": f"{TICK}clk", "max-time": f"{TICK * MOST}clk", "filter": "5"}
    folder, manifest = made(generated, Case("core", Settings("m", words), 0))
    for line, length in ((0, 1), (1, 4)):
        rows = in_icarus(folder, manifest, Lines(6 * TICK, 0, [], [(0, line, length)]).play())
        assert {row["position"] for row in rows} == {0}
        assert not any(row["decode_error"] for row in rows)
