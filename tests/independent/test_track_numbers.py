"""Constants of the tracking method, from the words of docs/concepts/track.md and the rules in reference/tracker.py."""

import math
import random
from collections.abc import Callable
from statistics import fmean, median
from typing import Any

import pytest
from independent.test_numbers import turned
from reference.tracker import Tracker

Found = Callable[..., Any]
CLOCK, TICK, COUNTS = 48_000_000, 960, 2000
WORDS = {"method": "track", "ppr": "500", "clock": "48MHz", "tick": "20us", "max-time": "100ms"}


def shown(golden: Found, words: dict[str, str], edges: list[int], n_clocks: int) -> Any:
    """Return the updates of a shaft that turns forward, an edge at each of these clocks."""
    return golden(WORDS | words, [0, *edges], n_clocks, **turned([1] * len(edges)))["velocity_valid"]


@pytest.mark.parametrize("words", [{}, {"multiplier": "block", "filter": "7clk"}, {"unit": "rpm"}])
def test_the_velocity_is_that_of_its_clock(golden: Found, described: Found, words: dict[str, str]) -> None:
    """On a ramp of 40,000 rad/s² for 20 ms, by a third of a clock."""
    slope = 40_000 * COUNTS / (2 * math.pi) / CLOCK**2  # counts per clock²
    edges = [round(math.sqrt(2 * k / slope)) for k in range(1, int(slope * (CLOCK // 50) ** 2 / 2))]
    updates = shown(golden, words, edges, edges[-1])
    lsb = described(WORDS | words)["velocity"]["rad_per_s_per_lsb"] * COUNTS / (2 * math.pi) / CLOCK
    late = updates.clock - updates.velocity * lsb / slope
    assert abs(late[500:].mean()) < 1 / 3


def test_a_silence_bounds_the_speed_at_5_8_of_a_count(golden: Found) -> None:
    """In the time from the last edge to the clock in which it is shown; a logarithm is off by at most 0.4 %, and by
    nothing in the mean, as is a power by 0.2 %.
    """
    edges = [3 * TICK * k for k in range(1, 1001)]
    updates = shown(golden, {}, edges, edges[-1] + 90 * CLOCK // 1000)
    counts = (updates.velocity / 2**24 * (updates.clock - edges[-1]) / TICK)[3050:]
    assert len(counts) > 4000
    assert (abs(counts / (5 / 8) - 1) < 0.006).all()
    assert counts.mean() == pytest.approx(5 / 8, rel=0.0007)


def test_a_silence_of_the_maximum_time_is_a_rest_and_one_of_100_ms_is_forgotten(golden: Found) -> None:
    edges = [3 * TICK * k for k in range(1, 101)]
    updates = shown(golden, {"max-time": "50ms"}, edges, edges[-1] + 110 * CLOCK // 1000)
    silence = [
        TICK * nth - 1 - 2 - edges[-1] for nth in range(1, len(updates) + 1)
    ]  # two clocks from a pin to its count
    assert (updates.velocity == 0).tolist()[300:] == [20 * clocks >= CLOCK for clocks in silence[300:]]
    assert (updates.velocity_std == 0).tolist()[300:] == [10 * clocks >= CLOCK for clocks in silence[300:]]


def beside(golden: Found, described: Found, edges: list[int], memory: int) -> list[tuple[float, ...]]:
    """Return velocity and deviation of every tick, in counts per tick; by the rules the latter lacks its factor."""
    words = {"max-memory": f"{memory}clk"}
    latency, updates = described(WORDS | words)["latency_cycles"], shown(golden, words, edges, edges[-1])
    counts: list[list[tuple[int, int]]] = [[] for _ in range(len(updates) + 1)]
    for edge in edges:
        counted = edge + latency["pin_to_count"]
        counts[min(counted // TICK, len(updates))].append((counted, 1))
    model, rows = Tracker(memory, CLOCK // 10, CLOCK // 10, sum(latency.values())), []
    for nth, row in enumerate(zip(updates.velocity.tolist(), updates.velocity_std.tolist(), strict=True)):
        velocity = model.tick((nth + 1) * TICK - 1, counts[nth])
        deviation = math.sqrt(max(model.expected, 9 / 14 * model.lag**2)) / model.memory if model.phase == 2 else 0
        rows.append((*(value / 2**24 for value in row), velocity * TICK, deviation * TICK))
    return rows


def uneven(n: int, swing: float = 0, displaced: float = 0) -> list[int]:
    """Return edges, 10 in 11 ticks or in a swing about it, off by 5 % of a count and from the 1000th on one of four
    by more.
    """
    rng, tick, found, phase = random.Random(1), 0.0, [], 2 * math.pi / 3000
    for k in range(3, n):
        place = k + rng.gauss(0, 0.05) + displaced * (k > 1000 and k % 4 == 0)
        for _ in range(5):
            passed = 10 / 11 * tick + swing / phase * (1 - math.cos(tick * phase))
            tick += (place - passed) / (10 / 11 + swing * math.sin(tick * phase))
        found.append(round(tick * TICK))
    return sorted(found)


@pytest.mark.parametrize(("events", "factor"), [(32, 12), (200, 2.3)])
def test_quality_is_that_of_the_order(golden: Found, described: Found, events: int, factor: float) -> None:
    """A parabola, where there are less than 64 events in the memory, or a line, as there is no acceleration."""
    rows = beside(golden, described, uneven(6000), round(events * 1.1 * TICK))
    assert fmean(abs(own / rule / factor - 1) for _, own, _, rule in rows[2000:]) < 0.01


def test_quality_is_that_of_the_least_noise_and_of_lost_counts(golden: Found) -> None:
    """An ideal disc has a noise of 2^-10; X·L is 1/8 after counts were lost, for 1/32, and is halved in 820 events."""
    edges = [1056 * k for k in range(1, 5000) if not 2000 <= k < 2004]
    velocity_std = shown(golden, {"max-memory": f"{32 * 1056}clk"}, edges, edges[-1]).velocity_std / 2**24
    for events, more in ((-20, 1), (410, 4 * 2**-0.5), (820, 2), (1230, 2**0.5), (1700, 1)):
        wanted = 12 * 2**-10 * math.sqrt(more / 32) / 35.2
        assert velocity_std[round(1.1 * (2004 + events))] == pytest.approx(wanted, rel=0.01), events


@pytest.mark.parametrize("ticks", [slice(60, 120), slice(1100, 2400)])
def test_offsets_are_learned_by_the_rules(golden: Found, described: Found, ticks: slice) -> None:
    """By 1/4 to 1/128 of an error, the latter from 504 events on."""
    rows = beside(golden, described, uneven(2200, displaced=0.1), 32 * TICK)[ticks]
    assert median(abs(own - rule) for own, _, rule, _ in rows) < median(row[1] for row in rows) / 300


def test_a_memory_finds_its_length_by_the_rules(golden: Found, described: Found) -> None:
    rows = beside(golden, described, uneven(8000, swing=0.3), CLOCK)[1000:]
    assert median(abs(own - rule) for own, _, rule, _ in rows) < median(row[1] for row in rows) / 100


def test_a_memory_has_up_to_8192_events(golden: Found, described: Found) -> None:
    """Its quality says so; while it is long, the noise of the rules is 3/2 of D."""
    rows = beside(golden, described, uneven(12_000), CLOCK)[10_000:]
    assert fmean(row[1] for row in rows) == pytest.approx(2.3 / 1.5 * fmean(row[3] for row in rows), rel=0.1)
