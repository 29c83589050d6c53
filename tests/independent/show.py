"""The ports must show measurements with rounding, units, saturation, bounds and the low-pass filter."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from fractions import Fraction

from independent.bench import Manifest, Row
from reference.front import Tick
from reference.settings import Settings
from reference.tsuji import Bound, Update


def nearest(number: Fraction) -> int:
    """Return ⌊x + ½⌋."""
    return math.floor(number + Fraction(1, 2))


def limit_of(settings: Settings) -> float:
    """Return the greatest magnitude that `velocity` can have."""
    return math.inf if settings.velocity_bits is None else (1 << settings.velocity_bits - 1) - 1


def check_velocity(settings: Settings, speed: Fraction, row: Row, slack: Fraction = Fraction(0)) -> None:
    """`velocity` is the speed: correctly rounded in counts per tick, else off by less than one LSB; or saturated."""
    exact = speed * settings.lsb_per_count
    if settings.native and not slack:
        low = high = nearest(exact)
    else:
        low, high = math.floor(exact - 1 - slack) + 1, math.ceil(exact + 1 + slack) - 1
    limit = limit_of(settings)
    assert max(-limit, min(limit, low)) <= row["velocity"] <= max(-limit, min(limit, high)), (float(exact), row)
    possible = {not -limit <= value <= limit for value in (low, high)}
    assert bool(row.get("velocity_overflow", 0)) in possible, (float(exact), row)


def check_bounds(settings: Settings, update: Update, row: Row, none: int, seen: set[str]) -> None:
    """Bounds are rounded outward; one that is absent, or beyond what fits, is ±none."""
    assert row["bounds_valid"] == update.known, row
    if not update.known:
        return
    ends: list[tuple[Bound, int, str]] = [(update.lower, -1, "velocity_lower"), (update.upper, 1, "velocity_upper")]
    for bound, way, name in ends:
        if bound is None:
            assert row[name] == way * none, (name, row)
            seen.add(name)
            continue
        exact = bound * settings.lsb_per_count * way
        least = math.ceil(exact)
        most = least if settings.native else least + 1
        assert min(least, none) <= row[name] * way <= min(most, none) or abs(exact) >= none, (name, float(exact), row)


def check_updates(
    settings: Settings,
    manifest: Manifest,
    updates: Sequence[Update],
    rows: Sequence[Row],
    ticks: Sequence[Tick],
    slack: Fraction = Fraction(0),
) -> set[str]:
    """Return every update, its clock and all that comes with it, but `standstill`; which bounds have been absent."""
    latency = manifest["latency_cycles"]
    late = latency["tick_latency"] + latency["tick_to_velocity"]
    assert [update.cause + late for update in updates[: len(rows)]] == [row["clock"] for row in rows]
    assert len(updates) - len(rows) in (0, 1)  # the run may end before an update is shown
    seen: set[str] = set()
    state, before = 0.0, -1
    for update, row in zip(updates, rows, strict=False):
        speed = update.speed
        if settings.lowpass is not None:
            # Eq. (22), the time being that since the update before.
            passed = sum(before < tick.last <= update.cause for tick in ticks)
            before = update.cause
            state += -math.expm1(-float(settings.lowpass * passed * settings.tick_seconds)) * (float(speed) - state)
            speed = Fraction(state)
            check_velocity(settings, speed, row, slack or Fraction(1, 1000))
        else:
            check_velocity(settings, speed, row, slack)
        assert row["interval"] == update.interval, (update, row)
        assert row["forced"] == update.forced, (update, row)
        for name, value in update.others.items():
            if name in row:
                assert row[name] == value, (name, update, row)
            else:
                assert name == "out_of_range", name
                assert not value
        if settings.flag("bounds"):
            check_bounds(settings, update, row, manifest["bounds"]["none"], seen)
    return seen


def check_age(settings: Settings, manifest: Manifest, updates: Sequence[Update], rows: Sequence[Row]) -> None:
    """`age` is how many ticks there were after the cause of the newest update, this one included, or the maximum."""
    latency = manifest["latency_cycles"]
    ticks = [row["clock"] for row in rows if row["tick"]]
    causes = [update.cause + latency["tick_latency"] for update in updates]
    for nth, row in enumerate(row for row in rows if row["tick"]):
        known = bisect_right(causes, row["clock"] - latency["tick_to_velocity"])
        after = bisect_right(ticks, causes[known - 1]) if known else 0
        assert row["age"] == min(nth + 1 - after, settings.max_ticks), row
