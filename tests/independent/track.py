"""Some outputs of tracking do not depend on its filter: times, ages, rest and limits."""

from collections.abc import Sequence
from fractions import Fraction

from independent.bench import Manifest, Row
from independent.show import limit_of
from reference.front import Tick, wrapped
from reference.settings import Settings
from reference.tsuji import Update


def track_updates(settings: Settings, ticks: Sequence[Tick]) -> list[Update]:
    """Return an update for every tick; the speeds are known at rest, and where there are more counts than may be."""
    found = []
    silent = settings.max_ticks  # before reset there was no count
    for tick in ticks:
        interval = min(silent + 1, settings.max_ticks)
        silent = silent + 1 if tick.empty else 0
        found.append(Update(tick.last, Fraction(tick.count), interval, forced=tick.empty))
    return found


def check_tracking(
    settings: Settings, manifest: Manifest, updates: Sequence[Update], rows: Sequence[Row], ticks: Sequence[Tick]
) -> None:
    """Every update with its clock; velocity, acceleration and fine position as far as they need no filter."""
    latency = manifest["latency_cycles"]
    late = latency["tick_latency"] + latency.get("tick_to_update", latency["tick_to_velocity"])
    assert [update.cause + late for update in updates] == [row["clock"] for row in rows]
    seen = {"rests": 0, "waits": 0}
    one, bits = 1 << settings.position_fine_bits, settings.position_bits + settings.position_fine_bits
    last = -settings.max_ticks * settings.tick
    for tick, update, row in zip(ticks, updates, rows, strict=False):
        assert row["interval"] == update.interval, (update, row)
        assert row["forced"] == update.forced, (update, row)
        most = min(limit_of(settings), float(settings.max_velocity * settings.lsb_per_count) + 1)
        assert abs(row["velocity"]) <= most, row
        off = wrapped(row["position_fine"] - tick.position * one, bits)
        if tick.empty:
            # The place is not further away than a count would be that comes late because of the noise that was seen.
            assert abs(off) <= 16 * one, row
        last = last if tick.empty else tick.last  # counts came before it
        if tick.last - last >= settings.max_ticks * settings.tick:
            assert row["acceleration"] == 0, row
            assert settings.lowpass is not None or row["velocity"] == 0, row
            seen["rests"] += 1
        seen["waits"] += tick.empty
    assert all(seen.values())
