"""The longest tick and the longest measurement take millions of clocks, in Verilator."""

import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
from independent.bench import in_verilator
from independent.cases import LONG
from independent.manifest import check_manifest
from independent.show import check_updates
from independent.stimulus import Lines, steady
from reference.front import conditioned, ticks_of
from reference.settings import Settings, arguments
from reference.tsuji import Update, s_updates

TICK = 1 << 20
# A count, another after half of the longest measurement, and then none.
FIRST, SECOND = 41, 41 + TICK // 2 + 7
LINES = {
    # 40,000 counts in a tick, then as many back, then a few.
    "s_long_tick": Lines(
        3 * TICK + 100, 0, steady(3, 1, 40_000) + steady(TICK + 5, 2, 40_000, -1) + steady(2 * TICK + 9, 9, 5)
    ),
    "s_long_time": Lines(SECOND + TICK + 100, 3, [(FIRST, 1), (SECOND, 1)]),
}


def two_counts(settings: Settings) -> list[Update]:
    """Return updates of method s for `s_long_time`, a tick of which is a clock: eq. (21) by hand, 2^20 terms being
    zeros.
    """
    late, half = 2, Fraction(1, 2)  # clocks from the pin to the tick of its count
    length = SECOND - FIRST
    return [
        Update(FIRST + late, half / (FIRST + late + 1), FIRST + late + 1),
        Update(SECOND + late, Fraction(1, length), length),
        Update(SECOND + late + settings.max_ticks, half / settings.max_ticks, settings.max_ticks, forced=True),
    ]


@pytest.mark.nightly
def test_long_ticks_and_long_measurements(generated: Callable[..., Path]) -> None:
    plays, manifests, folder = [], [], Path()
    for case in LONG:
        folder = generated(case.name, "--method", case.settings.method, *arguments(case.settings.words))
        manifests.append(json.loads((folder / f"{case.name}.json").read_text()))
        plays.append(LINES[case.name].play())
        check_manifest(case.settings, manifests[-1], case.name)
    for case, manifest, play, rows in zip(LONG, manifests, plays, in_verilator(folder, manifests, plays), strict=True):
        settings, latency = case.settings, manifest["latency_cycles"]
        front = conditioned(settings, play, latency["pin_to_count"])
        ends = list(range(settings.tick - 1, front.n_clocks, settings.tick)) if settings.tick > 1 else []
        ticks = ticks_of(settings, front, ends, settings.max_count)
        updates = two_counts(settings) if settings.tick == 1 else s_updates(settings, ticks)
        late = latency["tick_latency"] + latency["tick_to_velocity"]
        updates = [update for update in updates if update.cause + late < front.n_clocks]
        check_updates(settings, manifest, updates, rows, ticks)
        assert len(updates) > 2
