"""Users complain elsewhere of reversals and of rest: here are the methods that work on ticks, by their gates."""

from dataclasses import dataclass
from typing import Any

import pytest
from support.nightly import only
from support.simulate import clock_by_clock, ticks

from tachometry.hdl.methods import DATAPATHS
from tachometry.spec import Encoder, MTachometer, STachometer, TachometerSpec, Timing

T, MAX_TICKS = 6, 20
TIMING = Timing(1_000_000, T, MAX_TICKS)
SHARED: dict[str, Any] = {"encoder": Encoder(100), "timing": TIMING, "frac_bits": 10, "bounds": True}
SPECS = {
    "eq. (21)": STachometer(**SHARED),
    "eq. (17)": STachometer(**SHARED, cancel=False),
    "M": MTachometer(**SHARED),
    "M of 6": MTachometer(**SHARED, average=6),
}
each_method = pytest.mark.parametrize("spec", SPECS.values(), ids=SPECS)


@dataclass(frozen=True)
class Update:
    """An update in counts per tick; `tick` is the one that caused it."""

    tick: int
    velocity: float
    lower: float
    upper: float
    interval: int


def run(spec: TachometerSpec, m_e: list[int]) -> list[Update]:
    """Return updates of these pulse numbers."""
    names = ["velocity_valid", "velocity", "velocity_lower", "velocity_upper", "interval", "bounds_valid"]
    box = DATAPATHS[spec.method](spec)
    seen = clock_by_clock(box, ticks(box, m_e, T), names)[1:]
    found = []
    for clock, row in enumerate(seen):
        if row["velocity_valid"]:
            velocity, lower, upper = (row[name] / (1 << spec.velocity.frac_bits) for name in names[1:4])
            found.append(Update((clock - spec.latency.datapath) // T, velocity, lower, upper, row["interval"]))
    assert all(update.lower <= update.velocity <= update.upper for update in found)
    assert all(abs(update.velocity) <= spec.tick.max_count for update in found)
    return found


def longest(spec: TachometerSpec) -> int:
    """Return ticks within which the velocity is 0 after the last count: what the parameters promise."""
    return spec.average if isinstance(spec, MTachometer) else 3 * MAX_TICKS // 2


def check_rest(spec: TachometerSpec, updates: list[Update], last: int, n_ticks: int) -> None:
    """From `longest` ticks after the tick `last` on it reads 0, again and again, between bounds of either sign."""
    at_rest = [update for update in updates if update.tick >= last + longest(spec)]
    assert at_rest
    assert at_rest[0].tick <= last + 2 * longest(spec)
    assert n_ticks - at_rest[-1].tick <= MAX_TICKS
    assert all(update.velocity == 0 and update.lower < 0 < update.upper for update in at_rest)


@each_method
@pytest.mark.parametrize("sign", [1, -1])
def test_reversal(spec: TachometerSpec, sign: int) -> None:
    """Never faster than before; after it the other sign and the same speed."""
    there = [sign * 2] * 30
    updates = run(spec, there + [-number for number in there])
    assert all(abs(update.velocity) <= 2 for update in updates)
    assert [update.velocity for update in updates if update.tick < 30][-1] == sign * 2
    assert updates[-1].velocity == -sign * 2
    turned = next(update.tick for update in updates if update.velocity * sign < 0)
    assert turned < 30 + longest(spec)
    assert all(update.velocity * sign < 0 for update in updates if update.tick >= turned)


@each_method
@pytest.mark.parametrize("speed", only([[0, 1]], [[3], [0, 1], [0, 0, 0, 0, 1]]))
def test_standstill(spec: TachometerSpec, speed: list[int]) -> None:
    moving = speed * (60 // len(speed))
    check_rest(spec, run(spec, moving + [0] * 100), 59, 160)


@each_method
def test_one_count_then_silence(spec: TachometerSpec) -> None:
    updates = run(spec, [0] * 50 + [1] + [0] * 100)
    assert all(update.velocity == 0 for update in updates if update.tick < 50)
    # A count after a silence is no spike: it has come in half the longest time at least, or in the n ticks.
    most = 1 / spec.average if isinstance(spec, MTachometer) else 2 / MAX_TICKS
    assert all(0 <= update.velocity < most + 2**-spec.velocity.frac_bits for update in updates)
    check_rest(spec, updates, 50, 151)


RHYTHMS = [[1, -1], [1, 0, -1, 0], [0, 1, 0, 0, -1], [0] * 7 + [1] + [0] * 30 + [-1]]


@each_method
# The slowest has all that a faster one has, and more silence.
@pytest.mark.parametrize("rhythm", only(RHYTHMS[-1:], RHYTHMS))
def test_dithering_on_one_edge(spec: TachometerSpec, rhythm: list[int]) -> None:
    """Never more than a count in what was measured, so that 0 lies within the bounds; and 0 when it ends."""
    moving = rhythm * (200 // len(rhythm))
    updates = run(spec, moving + [0] * 100)
    for update in updates:
        assert abs(update.velocity) <= 1 / update.interval + 2**-spec.velocity.frac_bits
        assert update.lower <= 0 <= update.upper
    check_rest(spec, updates, len(moving) - 1, len(moving) + 100)


@each_method
def test_burst_after_standstill(spec: TachometerSpec) -> None:
    updates = run(spec, [0] * 50 + [T] * 8 + [0] * 100)
    assert max(update.velocity for update in updates) > T / 3
    assert all(0 <= update.velocity <= T for update in updates)
    check_rest(spec, updates, 57, 158)
