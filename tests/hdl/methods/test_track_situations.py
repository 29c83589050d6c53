"""Users complain of other trackers at rest, at reversals, at steps, and when counts are lost: here is this one."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only, only_rows

from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import Encoder, Speed, Timing, TrackTachometer

SPEC = TrackTachometer(
    encoder=Encoder(500),
    timing=Timing.parse("48MHz", "20us", "4ms"),
    max_speed=Speed.parse("1000rad/s"),
    frac_bits=16,
)
T, MAX_TICKS = SPEC.timing.tick_cycles, SPEC.timing.max_ticks
MEMORY = round(1 / float(SPEC.bandwidth * T) * SPEC.timing.clock_hz)  # 1/λ0 in ticks
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Shown:
    """All updates: the tick, the velocity in counts per tick, the position in counts, and the fine one less this."""

    tick: NDArray[np.int64]
    velocity: Floats
    position: Floats
    beyond: Floats

    def after(self, tick: float) -> "Shown":
        """Return those of later ticks."""
        later = self.tick > tick
        return Shown(self.tick[later], self.velocity[later], self.position[later], self.beyond[later])


def shown(spec: TrackTachometer, ticks: Floats, ways: NDArray[Any], n_ticks: int, lengths: Any = None) -> Shown:
    """Return what the core shows, which is what the golden model shows; edges with their times in nominal ticks.

    A way of 2 or −2 changes both lines.
    """
    level = quadrature(np.append(0, np.cumsum(ways)))
    clock = np.append(0, np.round(ticks * T).astype(np.int64) + 1)
    assert (np.diff(clock) > 0).all()
    trace = PinTrace(clock, level & np.uint8(1), level >> np.uint8(1), n_ticks * T)
    if lengths is not None:
        trace = trace.with_tick_in(np.cumsum(lengths))
    found = lockstep(spec, trace, Cxxrtl())
    assert not found.first, found.first[0]
    updates, rows = found.actual.updates, found.actual.ticks
    position = rows.position[: len(updates.clock)]
    fine = updates["position_fine"] / (1 << spec.fine_bits)
    velocity = updates.velocity / (1 << spec.widths.frac_bits)
    return Shown(rows.clock[: len(position)] // T, velocity, position.astype(float), fine - position)


def at(*parts: tuple[float, float]) -> tuple[Floats, NDArray[np.int64]]:
    """Return times and ways of the counts of constant speeds, each for so many ticks; a speed of 0 has none."""
    times, ways, now, place = [], [], 0.0, 0.3
    for speed, ticks in parts:
        moved = place + speed * ticks
        up = np.arange(np.floor(place) + 1, np.floor(moved) + 1)
        edges = up if speed > 0 else np.arange(np.floor(place), np.floor(moved), -1)
        if speed:
            times.append(now + (edges - place) / speed)
            ways.append(np.full(len(edges), np.sign(speed)))
        now, place = now + ticks, moved
    return np.concatenate(times), np.concatenate(ways).astype(np.int64)


def settled(found: Shown, velocity: float, share: float) -> int:
    """Return ticks of these in which the velocity was last off by more than a share."""
    wrong = np.flatnonzero(np.abs(found.velocity - velocity) > share * abs(velocity))
    return int(found.tick[wrong[-1]] - found.tick[0]) if len(wrong) else 0


# Of every situation one speed is about a count per tick; the rest shows how the bounds grow with the speed.
@pytest.mark.parametrize("speed", only([0.5], [0.02, 0.5, -3]))
def test_standstill(speed: float) -> None:
    """The speed falls as 1 + 1.5·E counts over the silence, and is 0 when the maximum time is over, as is p."""
    found = shown(SPEC, *at((speed, 300), (0, 500)), 800).after(301)
    assert (np.diff(np.abs(found.velocity)) <= 0).all()
    silence = found.tick - 300  # or more
    assert (np.abs(found.velocity) <= np.minimum(1.001 * abs(speed), 1.6 / silence + 1e-4)).all()
    rest = found.after(300 + MAX_TICKS)
    assert not rest.velocity.any()
    assert not rest.beyond.any()


RHYTHMS = [(10, 10), (1.3, 7.2), (0.1, 0.1), (50, 3), (0.02, 30), (0.3, 190)]


@pytest.mark.parametrize("rhythm", only([(1.3, 7.2), (0.02, 30)], RHYTHMS))
@pytest.mark.parametrize("sign", only([-1], [1, -1]))
def test_dithering_on_one_edge(rhythm: tuple[float, float], sign: int) -> None:
    """It reads 0 for ever, and the fine position is where the edge is."""
    times = np.cumsum(np.tile(rhythm, 100)) + 5
    times = times[times < 1500]
    ways = np.resize([sign, -sign], len(times))
    found = shown(SPEC, times, ways, 2000)
    assert not found.velocity.any()
    moving = found.after(times[0] + 1)
    place = (moving.position + moving.beyond)[moving.tick < times[-1]]
    assert (np.abs(place - sign / 2) <= 0.5).all()


@pytest.mark.parametrize("speed", [0.05, 0.5, 2, 3.1])
def test_start(speed: float) -> None:
    """The second count of a constant speed is enough."""
    found = shown(SPEC, *at((0, 300), (speed, 300)), 600).after(300)
    moving = found.after(found.tick[np.flatnonzero(found.velocity)[0]] - 1)
    assert moving.tick[0] <= 300 + 2 / speed + 2
    assert np.abs(moving.velocity / speed - 1).max() < 1e-3


@pytest.mark.parametrize("speed", only([0.5, 2], [0.05, 0.5, 2, 3.1]))
@pytest.mark.parametrize("sign", only([-1], [1, -1]))
def test_reversal(speed: float, sign: int) -> None:
    """The sign is right after 2 counts and ¼/λ0, and stays so; the speed is within 5 % after 4/λ0 and 25 counts.

    Below a count per tick the sign takes 3 counts and ⅓/λ0: there a tick without a count says that the shaft is slower.
    """
    found = shown(SPEC, *at((sign * speed, 400), (-sign * speed, 500)), 900).after(400)
    turned = found.after(400 + (max(2 / speed, MEMORY / 4) if speed >= 1 else max(3 / speed, MEMORY / 3)))
    assert (turned.velocity * sign < 0).all()
    assert np.abs(found.velocity).max() < 1.6 * speed
    assert settled(found, -sign * speed, 0.05) < max(4 * MEMORY, 25 / speed)


STEPS = [(0.5, 1), (1, 0.5), (2, 3), (1, 3), (3, 0.3), (0.05, 0.1), (0.1, 0.05)]


@pytest.mark.parametrize(("before", "then"), only_rows([(1, 0.5), (1, 3)], STEPS))
def test_step_of_speed(before: float, then: float) -> None:
    """Within a tenth after 1.5/λ0, within 1 % after 6/λ0, if this is the time of 20 and of 40 counts.

    It takes a tenth longer where ticks without a count begin.
    """
    longer = 1.1 if then < 1 <= before else 1
    found = shown(SPEC, *at((before, 500), (then, 600)), 1100).after(500)
    assert settled(found, then, 0.1) < longer * max(1.5 * MEMORY, 23 * MEMORY * 0.02 / then)
    assert settled(found, then, 0.01) < longer * max(6 * MEMORY, 46 * MEMORY * 0.02 / then)
    assert found.velocity.max() < 1.25 * max(before, then)


LOST = 450  # the tick in which it happens


def check_lost(found: Shown, speed: float, longer: float = 1) -> None:
    """Within a tenth after 1.6/λ0 or 37 counts, and within 1 % after 6/λ0 or 75 counts; never above 1.4 times."""
    after = found.after(LOST)
    assert (after.velocity > 0).all()
    assert after.velocity.max() < 1.4 * speed
    assert settled(after, speed, 0.1) < longer * max(1.6 * MEMORY, 37 / speed)
    assert settled(after, speed, 0.01) < longer * max(6 * MEMORY, 75 / speed)


@pytest.mark.parametrize("speed", only([1], [0.3, 1, 3]))
@pytest.mark.parametrize("number", only([1, 10], [1, 3, 10]))
def test_lost_pulses(speed: float, number: int) -> None:
    """The lines stand still while the shaft goes on; ten counts below a count per tick take a quarter longer."""
    times, ways = at((speed, 900))
    first = np.searchsorted(times, LOST)
    lost = slice(first, first + number)
    longer = 1.25 if (speed, number) == (0.3, 10) else 1
    check_lost(shown(SPEC, np.delete(times, lost), np.delete(ways, lost), 900), speed, longer)


@pytest.mark.parametrize("speed", [0.3, 1, 3])
def test_illegal_transition(speed: float) -> None:
    """Two counts are lost."""
    times, ways = at((speed, 900))
    ways[np.searchsorted(times, LOST)] = 2
    check_lost(shown(SPEC, times, ways, 900), speed)


@pytest.mark.parametrize("speed", only([1], [0.05, 0.3, 1, 2.5]))
def test_external_ticks_that_fluctuate(speed: float) -> None:
    """By ±10 %: a constant speed stays constant, within an LSB or 0.1 per mille."""
    spec = replace(SPEC, external_tick=True, max_tick_cycles=1200)
    lengths = np.round(T * np.random.default_rng(1).uniform(0.9, 1.1, 1400)).astype(np.int64)
    found = shown(spec, *at((speed, 1000)), 1000, lengths).after(100)
    assert np.abs(found.velocity - speed).max() < max(2**-spec.widths.frac_bits, 1e-4 * speed)


def test_beyond_the_greatest_speed() -> None:
    """It shows the greatest speed, and the right one soon after."""
    found = shown(SPEC, *at((2, 300), (20, 100), (2, 300)), 700)
    fast = found.after(302)
    assert (fast.velocity[fast.tick < 400] == SPEC.scale.full_scale / (1 << SPEC.widths.frac_bits)).all()
    assert settled(found.after(402), 2, 0.05) < 3 * MEMORY


def test_lines_that_rattle() -> None:
    """A line that changes in every clock, or in every third, is no speed."""
    for apart in (1, 3):
        times = 5 + np.arange(200_000 // apart) * apart / T
        found = shown(SPEC, times, np.resize([1, -1], len(times)), 500)
        assert np.abs(found.velocity).max() < 1e-3
        assert np.abs(found.position + found.beyond).max() <= 1
