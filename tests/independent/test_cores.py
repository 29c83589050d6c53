"""Every method, unit and option as exported Verilog, against the models of this folder."""

import json
import math
import random
from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path

import pytest
from independent.bench import Manifest, Row, in_icarus
from independent.cases import CASES, SILENT, Case, parameters
from independent.manifest import check_manifest
from independent.show import check_age, check_updates
from independent.stimulus import Lines, external, motion
from independent.track import check_tracking, track_updates
from reference.front import Front, Tick, compared, conditioned, external_ends, faults, index_positions, ticks_of
from reference.rairan import rairan_updates
from reference.settings import arguments
from reference.timed import timed_updates
from reference.tsuji import Update, m_updates, s_updates

# Cores that show `bounds.none` at some time, because there is no bound.
ABSENT = {"t_native": {"velocity_upper"}, "rairan_rpm": {"velocity_lower", "velocity_upper"}}
Generated = Callable[..., Path]


def made(generated: Generated, case: Case) -> tuple[Path, Manifest]:
    """Return the folder of a core, and its manifest."""
    words = case.settings.words
    folder = generated(case.name, "--method", case.settings.method, *arguments(words))
    return folder, json.loads((folder / f"{case.name}.json").read_text())


def lines_of(case: Case, manifest: Manifest) -> Lines:
    """Return a motion and a rest, with all else that the core has pins for."""
    settings, rng = case.settings, random.Random(case.seed or case.name)
    tick, hold = settings.tick, settings.filter
    lines = Lines(case.clocks + 3 * settings.max_ticks * tick, rng.randrange(4))
    least, start = max(case.least, hold + 1), 3 * hold
    there = [start + 5 + nth * least for nth in range(8)]  # forth and back: a reversal, before all else
    lines.edges = [(at, 1 if nth < 4 else -1) for nth, at in enumerate(there)]
    moves = motion(rng, tick, case.clocks, least=least, turns=case.turns, within=case.within)
    lines.edges += [(at, by) for at, by in moves if at > there[-1] + least]
    if not case.within and case.turns:
        free = [
            at + 1 for (at, _), (then, _) in zip(lines.edges, lines.edges[1:], strict=False) if then > at + 3 + 2 * hold
        ]
        lines.edges += [(at + hold, 2) for at in rng.sample(free, min(6, len(free)))]
    if hold:
        spans = [(rng.randrange(start, case.clocks), rng.randrange(2), rng.randrange(1, hold + 1)) for _ in range(20)]
        lines.glitches = spans
    if settings.flag("index"):
        begins = range(start, case.clocks, 8 * tick + 3)
        lines.pulses = [(at + rng.randrange(tick), 2, rng.choice((hold + 1, hold, tick))) for at in begins]
    if settings.external:
        ends = manifest["external_tick_cycles"]
        least = ends["min"] if settings.lowpass is None else tick * 3 // 4
        rises = external(rng, tick, lines.n_clocks, least=least, most=ends["max"], regular=bool(case.within))
        lines.pulses += rises
    return lines


def model(case: Case, manifest: Manifest, front: Front) -> tuple[list[Update], list[Tick], list[int]]:
    """Return updates, ticks, and clocks of `tick_error` without its latency."""
    settings = case.settings
    if settings.method == "rairan":
        updates, ends = rairan_updates(settings, front)
        most = settings.max_count << settings.greatest_shift
        return updates, ticks_of(settings, front, ends, most, held=True), []
    ends = list(range(settings.tick - 1, front.n_clocks, settings.tick))
    wrong: list[int] = []
    if settings.external:
        late, bounds = manifest["latency_cycles"]["tick_in_to_window_end"], manifest["external_tick_cycles"]
        rises = [at + late for at in front.rises]
        ends, wrong = external_ends(rises, front.n_clocks, bounds["min"], bounds["max"])
    ticks = ticks_of(settings, front, ends, settings.max_count)
    if settings.method == "track":
        return track_updates(settings, ticks), ticks, wrong
    if settings.method in ("s", "m"):
        return (s_updates if settings.method == "s" else m_updates)(settings, ticks), ticks, wrong
    # The update comes a clock after the division; in other units the motion keeps clear of it.
    return timed_updates(settings, front, ticks, manifest["latency_cycles"]["tick_to_velocity"] - 1), ticks, wrong


def check_front(
    case: Case, manifest: Manifest, front: Front, ticks: list[Tick], rows: list[Row], wrong: list[int]
) -> None:
    """Ticks, pulse numbers, positions, index, errors and filtered edges."""
    settings, late, n = case.settings, manifest["latency_cycles"]["tick_latency"], front.n_clocks
    seen = [row for row in rows if row["tick"]]
    first = ticks[0].last
    keys = ("clock", "pulse_count", "overflow", "position")
    assert [tuple(row[key] for key in keys) for row in seen if row["clock"] >= first + late] == [
        (tick.last + late, tick.count, tick.overflow, tick.position) for tick in ticks if tick.last + late < n
    ]
    errors = [row["clock"] for row in rows if row["decode_error"]]
    assert errors == [at for at in front.errors if at < n]
    if settings.flag("index"):
        captured = [(row["clock"] - late, row["index_position"]) for row in rows if row["index_valid"]]
        assert captured == [pair for pair in index_positions(settings, front) if pair[0] + late < n]
        assert captured
        assert [row["clock"] - late for row in rows if row["index_missed"]] == [
            at for at in front.missed if at + late < n
        ]
    if settings.external:
        assert [row["clock"] - late for row in rows if row["tick_error"]] == [at for at in wrong if at + late < n]
        assert wrong
    if "position-compare" in settings.words:
        spare = manifest["latency_cycles"]["pin_to_position_compare"] - manifest["latency_cycles"]["pin_to_count"]
        wanted = compared(settings, front)
        assert [
            (row["clock"] - spare, row["position_compare_position"]) for row in rows if row["position_compare_valid"]
        ] == wanted
        assert wanted or settings.method in ("mt", "track")  # whose motions do not come there
        for row in seen:
            before = [at + spare for at, _ in wanted if at + spare <= row["clock"]]
            assert row["position_compare_count"] == len(before)
            assert row["position_compare"] == (bool(before) and row["clock"] - before[-1] < 7)
    if settings.flag("health"):
        check_health(faults(settings, front, late), seen)
    if settings.filter:
        glitches = sorted(front.glitches)
        for row in seen:
            gone = [bisect_right(glitches, row["clock"] - spare) for spare in (2, 4)]
            assert 2 * gone[1] <= row["filtered_edges"] <= 2 * gone[0]
        assert seen[-1]["filtered_edges"] == 2 * len(front.glitches) > 0


def check_health(found: list[tuple[int, int, int]], seen: list[Row]) -> None:
    """The first fault, how many clocks had one, and the latest wrong turn, from the clock after each."""
    for row in seen:
        before = [fault for fault in found if fault[0] < row["clock"]]
        wrong = [off for _, _, off in before if off]
        assert row["health"] == (before[0][1] if before else 0)
        assert row["fault"] == bool(before)
        assert row["faults"] == min(len({at for at, *_ in before}), 255)
        assert row["index_error"] == (wrong[-1] if wrong else 0)
    assert len(found) > 2


def check_core(case: Case, folder: Path, manifest: Manifest) -> None:
    """Manifest and all outputs of a core, over its motion."""
    check_manifest(case.settings, manifest, case.name)
    latency = manifest["latency_cycles"]
    lines = lines_of(case, manifest)
    play = lines.play()
    rows = in_icarus(folder, manifest, play)
    front = conditioned(case.settings, play, latency["pin_to_count"])
    updates, ticks, wrong = model(case, manifest, front)
    late = latency["tick_latency"] + latency.get("tick_to_update", latency["tick_to_velocity"])
    check_front(case, manifest, front, ticks, rows, wrong)
    shown = [row for row in rows if row["velocity_valid"]]
    updates = [update for update in updates if update.cause + late < front.n_clocks]
    absent = set[str]()
    if case.settings.method == "track":
        whole = [row for row in rows if row.get("update_valid", row["velocity_valid"])]
        check_tracking(case.settings, manifest, updates, whole, ticks)
        first = latency["tick_to_velocity"] - latency.get("tick_to_update", latency["tick_to_velocity"])
        early = [(row["clock"] + first, row["velocity"]) for row in whole]
        assert early == [(row["clock"], row["velocity"]) for row in shown[: len(early)]]
    else:
        absent = check_updates(case.settings, manifest, updates, shown, ticks)
    if "over-speed" in case.settings.words:
        limit = float(case.settings.words["over-speed"].removesuffix("rpm")) * math.pi / 30
        lsb = manifest["velocity"]["rad_per_s_per_lsb"]
        beyond = [row["clock"] for row in rows if row["velocity_valid"] and abs(row["velocity"]) * lsb > limit + 1e-9]
        assert beyond
        assert all(row["over_speed"] == (row["clock"] > beyond[0]) for row in rows if row["tick"])
    if case.settings.flag("age"):
        check_age(case.settings, manifest, updates, rows)
    assert absent >= ABSENT.get(case.name, set())
    assert len(updates) > 12
    assert any(row.get("velocity_overflow") for row in shown) == case.settings.narrow


# One core of each method has most of its options; the rest are ends of ranges.
SHORT = {"s_rpm", "m_rpm", "t_lattice", "mt_rpm", "rairan_rpm", "track_rpm"}
NIGHTLY = [case.name for case in CASES if case.name not in SHORT]


@pytest.mark.parametrize("case", parameters((case for case in CASES if case not in SILENT), nightly=NIGHTLY))
def test_core(case: Case, generated: Generated) -> None:
    check_core(case, *made(generated, case))
