"""Every method that measures times keeps the promises of docs/concepts/timed.md, clock by clock."""

from typing import Any

import pytest
from support.timed import FRAC_BITS, SILENCE, TICK, decay, run, silence, spec_of, speed

from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.spec import MTTachometer, Speed, Timing
from tachometry.spec.methods.timed import TimedTachometer

METHODS = ["t", "mt"]


def timed(method: str, **options: Any) -> TimedTachometer:
    """Return a measurement with each count, if they are not too close."""
    return spec_of(method, **options, **({"min_time": 1} if method == "mt" else {}))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sign", [1, -1])
def test_steady_speed(method: str, sign: int) -> None:
    """The first count opens; from the second on every one gives a speed."""
    at = list(range(5, 400, 45))
    got = run(timed(method), dict.fromkeys(at, sign), 400)
    assert got == [(clock, sign * speed(1, 45), 45, False) for clock in at[1:]]


@pytest.mark.parametrize("method", METHODS)
def test_reversal(method: str) -> None:
    """An edge that is met twice adds no distance."""
    steps = {5: 1, 45: 1, 95: -1, 125: -1, 175: -1}
    got = run(timed(method, bound_decay=False), steps, 180)
    ways = [(45, 1, 40), (95, 0, 50), (125, -1, 30), (175, -1, 50)]
    assert [row[:3] for row in got] == [(clock, speed(way, time), time) for clock, way, time in ways]


def check_standstill(method: str, sign: int = 1) -> None:
    """The speed decays tick by tick as 1½ counts over the silence, and is 0 when the maximum time is over."""
    steps = {5: sign, 25: sign, 45: sign}
    n = 45 + 3 * SILENCE
    v = sign * speed(1, 20)
    moving = [(25, v, 20, False), (45, v, 20, False)]
    spec = timed(method)
    # The 0 takes the divider from the last of them.
    decaying = decay(45, v, 45 + SILENCE - spec.form.division_clocks + 1)
    assert run(spec, steps, n) == moving + decaying + silence(45, n)
    without = run(timed(method, bound_decay=False), steps, n)
    assert without == moving + silence(45, n)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sign", [1, -1])
def test_standstill(method: str, sign: int) -> None:
    check_standstill(method, sign)


def check_greatest_speed(method: str, sign: int = 1) -> None:
    """Check that a speed that is too high is held at the limit, whichever way, and a lower one is not."""
    spec = timed(method, bound_decay=False, max_speed=Speed.parse("2rev/s"))
    assert spec.form.saturates
    # As many as a window takes; two counts.
    fast = range(5, 5 + spec.form.min_periods + 2) if isinstance(spec, MTTachometer) else {5, 9}
    got = run(spec, dict.fromkeys([*fast, 139], sign), 180)
    last, first = max(fast), min(fast)
    velocities = [(last, 2 << FRAC_BITS, last - first), (139, speed(1, 139 - last), 139 - last)]
    assert [row[:3] for row in got] == [(clock, sign * velocity, time) for clock, velocity, time in velocities]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("sign", [1, -1])
def test_greatest_speed(method: str, sign: int) -> None:
    check_greatest_speed(method, sign)


def test_too_far() -> None:
    """A window so long and so fast that the divider does not take its distance is held there, too."""
    for time in (205, 400):
        spec = spec_of("mt", min_time=time - 1, bound_decay=False, max_speed=Speed.parse("2rev/s"))
        # In half counts, times the clocks in a tick. The first, less what the divider does not take, would be next to
        # nothing; the second still fits its register, but not when it is doubled.
        most, distance = 1 << (len(QuotientVelocity(spec).divider.dividend) - 2), 2 * TICK * time
        assert 0 < distance - most < TICK if time == 205 else 2 * most - distance < 2 * TICK * TICK
        for sign in (1, -1):
            got = run(spec, dict.fromkeys(range(5, 6 + time), sign), 6 + time)
            assert [row[1:3] for row in got] == [(sign * 2 << FRAC_BITS, time)]


@pytest.mark.parametrize("method", METHODS)
def test_one_count_then_silence(method: str) -> None:
    """One count is no speed."""
    n = 100 + 3 * SILENCE
    assert run(timed(method), {100: 1}, n) == silence(100, n)
    # After reset nothing has been counted.
    got = run(timed(method), {}, n)
    assert got == [(clock, 0, SILENCE, True) for clock in range(SILENCE - 1, n, SILENCE)]


@pytest.mark.parametrize("method", METHODS)
def test_counts_in_a_row(method: str) -> None:
    """The sign of the first counts for the second, which comes in the next clock."""
    got = run(timed(method, bound_decay=False), {5: -1, 6: -1, 60: -1}, 61)
    expected = [(6, speed(-1, 1), 1), (60, speed(-1, 54), 54)] if method == "t" else [(60, speed(-2, 55), 55)]
    assert [row[:3] for row in got] == expected


@pytest.mark.parametrize("method", METHODS)
def test_dithering_on_one_edge(method: str) -> None:
    """It reads 0 for ever, in any rhythm."""
    at = [7, 8, 9, 50, 51, 60, 100, 130, 131, 132, 133, 200, 229, 300]
    got = run(timed(method), {clock: (-1) ** k for k, clock in enumerate(at)}, 300 + 2 * SILENCE)
    assert len(got) > 4
    assert {velocity for _, velocity, *_ in got} == {0}


@pytest.mark.parametrize("method", METHODS)
def test_burst_after_standstill(method: str) -> None:
    """No speed exceeds one count a clock, and none is left when the maximum time is over."""
    begin = 2 * SILENCE + 10
    steps = {clock: 1 for clock in range(begin, begin + 60)}
    last, n = begin + 59, begin + 59 + 3 * SILENCE
    got = run(timed(method), steps, n)
    assert silence(last, n) == [row for row in got if row[0] > last and not row[1]]
    moving = [row for row in got if row[1]]
    assert [row[1] for row in moving if not row[3]] == [speed(1, 1)] * sum(not row[3] for row in moving)
    assert all(
        last < clock < last + SILENCE and 0 < v <= speed(3, 2 * age) for clock, v, age, forced in moving if forced
    )
    assert len(moving) > 5


@pytest.mark.parametrize("method", METHODS)
def test_count_at_the_maximum_time(method: str) -> None:
    """It is a count, and the silence of a clock more is one."""
    got = run(timed(method, bound_decay=False), {5: 1, 5 + SILENCE: 1, 6 + 2 * SILENCE: 1}, 7 + 2 * SILENCE)
    assert got == [(5 + SILENCE, speed(1, SILENCE), SILENCE, False), (5 + 2 * SILENCE, 0, SILENCE, True)]
    # Where a second 0 would be forced, it is the first after a silence.
    assert run(timed(method), {5: 1, 5 + 2 * SILENCE: 1}, 6 + 2 * SILENCE) == silence(5, 5 + 2 * SILENCE)


@pytest.mark.parametrize("method", METHODS)
def test_a_measurement_takes_the_divider_from_a_decay(method: str) -> None:
    spec = timed(method)
    tick = 6 * TICK - 1
    for clock in range(tick + 1, tick + 20):
        got = run(spec, {5: 1, 25: 1, 45: 1, clock: 1}, clock + 1)
        assert got[-1] == (clock, speed(1, clock - 45), clock - 45, False)
        decayed = (tick, speed(3, 2 * (tick - 45)), tick - 45, True)
        assert (decayed in got) == (clock >= tick + spec.form.division_clocks)


@pytest.mark.parametrize("method", METHODS)
def test_turning_tail(method: str) -> None:
    """A decay looks at the sign of the velocity, not of that before it; ticks here are shorter than a division."""
    for late in range(20):
        steps = {5: 1, 45: 1, 65: -1, 72 + late: -1}
        got = run(timed(method, timing=Timing(800, 8, 50)), steps, 72 + late + 100)
        assert all(velocity <= 0 for clock, velocity, *_ in got if clock > 65)


@pytest.mark.parametrize("method", METHODS)
def test_only_silence_decays(method: str) -> None:
    """Counts come late, 19 clocks after 10 that lay 10 apart, but the tick is not empty: nothing decays."""
    steps = {clock: 1 for clock in (*range(100, 201, 10), 201 + 19 + 18)}
    got = run(timed(method), steps, 220)
    assert len(got) > 3
    assert not any(forced and velocity for _, velocity, _, forced in got)
