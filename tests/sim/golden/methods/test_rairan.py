"""The golden model of Rairán's method: against Table 1 to the letter, and against its description, clock by clock."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from reference.front import Front
from reference.rairan import estimate, next_k, rairan_updates, table_1
from reference.sequences import rounded
from reference.settings import Settings
from reference.tsuji import Update
from support.nightly import only, only_rows
from support.rairan import golden_updates, make_spec, random_steps, steps_of

from tachometry.sim.golden.methods.adaptive import next_shift
from tachometry.sim.golden.methods.rairan import Model, orbit
from tachometry.sim.signals.run import Table
from tachometry.sim.theory.rairan import rairan_eq13_max_error
from tachometry.spec import RairanTachometer, Speed
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.methods.adaptive import AdaptiveDt, parse_target


def held(updates: Table, name: str, n: int, first: int) -> np.ndarray:
    """Return an output of the method at every ts, in time with its cause."""
    row = np.searchsorted(updates.clock, np.arange(n), side="right")
    return np.append(first, updates[name])[row]


@pytest.mark.parametrize("dt", only([1, 3, 1000], [1, 2, 3, 7, 40, 1000]))  # the least, one between, the longest
def test_to_the_letter_it_is_table_1_at_every_ts(dt: int) -> None:
    """A million ts of all speeds in each dt."""
    n = 1_000_000 if dt == 40 else 200_000
    spec = make_spec(dt, max_ticks=2000, paper_exact=True)
    step = random_steps(np.random.default_rng(dt), n, dt)
    updates = golden_updates(spec, step)
    wanted = np.array([(row.n_ep1, row.n_dt1) for row in table_1(step != 0, dt)])
    assert np.array_equal(held(updates, "n_ep1", n, 0), wanted[:, 0])
    assert np.array_equal(held(updates, "n_dt1", n, 1), wanted[:, 1])
    assert len(updates.clock) > n / dt / 20
    assert (updates.velocity >= 0).all()
    assert not updates.forced.any()


def check_description(spec: RairanTachometer, step: np.ndarray) -> list[Update]:
    """Hold every update and every end of dt against the description; these updates."""
    words = {"dt": f"{spec.timing.tick_cycles}clk", "max-time": f"{spec.timing.tick_cycles * spec.timing.max_ticks}clk"}
    words |= {"estimate": spec.estimate, "frac-bits": str(spec.velocity.frac_bits)}
    words |= {"bound-decay": "yes" if spec.bound_decay else "no"}
    words |= {} if spec.adaptive is None else {"adaptive": str(spec.adaptive)}
    settings = Settings("rairan", words)
    assert settings.greatest_shift == spec.times.max_tick_shift
    steps = {int(clock): int(step[clock]) for clock in np.flatnonzero(step)}
    found, ends = rairan_updates(settings, Front(len(step), steps))
    updates = golden_updates(spec, step)
    assert updates.clock.tolist() == [one.cause for one in found]
    assert updates.forced.tolist() == [one.forced for one in found]
    assert updates.rests.tolist() == [one.forced and not one.speed for one in found]
    assert updates.interval.tolist() == [one.interval for one in found]
    for name in found[0].others:
        assert updates[name].tolist() == [one.others[name] for one in found], name
    assert updates.velocity.tolist() == [rounded(one.speed, spec.velocity.frac_bits) for one in found]
    assert Model(spec).windows(steps_of(step), len(step))[0].tolist() == ends
    return found


# In 7 clocks counts are first, last and amid; the shorter dt is, the more updates there are, and the less is within it.
@pytest.mark.parametrize("dt", only([7], [1, 2, 3, 7, 40]))
@pytest.mark.parametrize("bound_decay", [True, False])
def test_it_does_what_is_described_clock_by_clock(dt: int, bound_decay: bool) -> None:
    for seed, kind in enumerate(("n1", "n2", "n3")):
        spec = make_spec(dt, max_ticks=12, bound_decay=bound_decay, estimate=kind, frac_bits=4 + 8 * (seed > 0))
        step = random_steps(np.random.default_rng([dt, seed]), 40_000, dt)
        found = check_description(spec, step)
        assert any(one.forced for one in found) == (bound_decay or any(one.forced and not one.speed for one in found))


def steady_steps(rng: np.random.Generator, n: int, dt: int) -> np.ndarray:
    """Return stretches of many counts at all speeds, so that dt settles, with reversals and rests; shape (n,)."""
    step, at, sign = np.zeros(n, dtype=np.int64), 0, 1
    while at < n:
        gap = max(1.0, dt * 10 ** rng.uniform(-1.3, 1.3))
        clocks = at + (np.arange(1, int(rng.integers(2, 150)) + 1) * gap).astype(np.int64)
        step[clocks[clocks < n]] = sign
        at = int(clocks[-1]) + int(rng.choice([0, 0, dt, 40 * dt]))
        sign *= int(rng.choice([1, 1, -1]))
    return step


ADAPTIVE = [(1, 12, "0.2"), (3, 40, "0.1"), (7, 70, "0.04"), (40, 33, "5%")]


@pytest.mark.parametrize(("dt", "max_ticks", "target"), only_rows(ADAPTIVE[2:], ADAPTIVE))
@pytest.mark.parametrize("bound_decay", [True, False])
def test_adaptive_dt_clock_by_clock(dt: int, max_ticks: int, target: str, bound_decay: bool) -> None:
    for seed, kind in enumerate(("n1", "n2", "n3", "n3")):
        goal = parse_target("adaptive", target)
        options = {"adaptive": goal, "bound_decay": bound_decay, "estimate": kind}
        spec = make_spec(dt, max_ticks, **options, frac_bits=5 + 7 * (seed > 0))
        rng = np.random.default_rng([dt, seed])
        step = steady_steps(rng, 60_000, dt) if seed < 3 else random_steps(rng, 60_000, dt)
        found = check_description(spec, step)
        assert {one.others["dt_shift"] for one in found} == set(range(spec.times.max_tick_shift + 1))


def test_orbit_follows_to_the_end() -> None:
    assert orbit(np.array([2, 2, 3, 5, 5, 5]), 0).tolist() == [0, 2, 3]
    assert orbit(np.array([1, 1]), 0).tolist() == [0]
    assert orbit(np.arange(1, 9).clip(max=7), 0).tolist() == list(range(7))


def pulses(period: Fraction, n: int, sign: int = 1) -> np.ndarray:
    """Return a count every so many clocks, in n clocks."""
    step = np.zeros(n, dtype=np.int64)
    at = (np.arange(1, int(n / period)) * period.numerator) // period.denominator
    step[at] = sign
    return step


# The way is a factor of the speed, which other tests have both ways.
@pytest.mark.parametrize("sign", only([-1], [1, -1]))
def test_table_1_locks_just_below_the_speed_limit_and_the_default_does_not(sign: int) -> None:
    """At 0.9995 ω_lim, a count every 1000.5 ts: n1 = ½ for ever, though the speed is outside [n2, n1] = [⅓, ½]."""
    step = pulses(Fraction(2001, 2), 300_000, sign)
    letter = golden_updates(make_spec(1000, paper_exact=True, estimate="n1"), step)
    locked = np.array([(row.n_ep1, row.n_dt1) for row in table_1(step != 0, 1000)])
    assert {tuple(row) for row in locked[100_000:].tolist()} == {(1, 2)}
    assert set((letter.velocity / 2**16)[10:]) == {0.5}
    default = golden_updates(make_spec(1000, estimate="n1"), step)
    assert set((default.velocity / 2**16)[10:]) == {sign * 1.0}


@pytest.mark.parametrize("clock", [3, 38, 41, 60, 78, 81, 130])
def test_to_the_letter_the_time_from_reset_is_a_measurement(clock: int) -> None:
    """Table 1 takes the first count for the second of two: Ndt1 is the number of whole dt before it."""
    step = np.zeros(400, dtype=np.int64)
    step[clock] = 1
    updates = golden_updates(make_spec(40, paper_exact=True), step)
    wanted = np.array([(row.n_ep1, row.n_dt1) for row in table_1(step != 0, 40)])
    assert np.array_equal(held(updates, "n_dt1", 400, 1), wanted[:, 1])
    whole = (clock + 1) // 40
    assert updates.clock[0] == (clock if whole else 39)
    assert updates.velocity[0] == rounded(estimate("n3", 1, max(whole, 1)) if whole else estimate("n3", 1, 1), 16)


def test_a_bound_that_would_divide_by_0_is_absent() -> None:
    """With dt of one clock and k = 1, two counts in two clocks are high; then one count in one clock is Nep1 = 1."""
    spec = make_spec(1, 40, adaptive=Fraction(1, 4), bounds=True, edge_error=Fraction(1, 8))
    step = np.zeros(30, dtype=np.int64)
    step[[0, 1, 2, 3, 7, 8, 9, 12, 14]] = 1
    updates = golden_updates(spec, step)
    low, high = (dict(zip(updates.clock.tolist(), updates[name].tolist(), strict=True)) for name in BOUNDS)
    none = spec.velocity.absent_bound
    # t − 1/T = 0 for one dt of one clock.
    assert (low[10], high[10]) == (-none, none)
    # −E/(1 − 1/2) and (1 + E)/(1 − 1/2) counts per dt of two clocks, which has two ticks.
    assert (low[16], high[16]) == (-(1 << 16) // 8, (9 << 16) // 8)


@pytest.mark.parametrize(("target", "n"), [("25%", 3), ("10%", 6)])
def test_as_many_counts_as_the_target_takes_leave_dt_as_it_is(target: str, n: int) -> None:
    """1/(2·Nep1 − 1), eq. (13), is at most the target for so many counts, from the very first window on."""
    spec = make_spec(60, 40, adaptive=parse_target("adaptive", target))
    for counts, wanted in ((n, {0}), (2 * n - 1, {0}), (n - 1, {0, 1})):
        step = np.zeros(900, dtype=np.int64)
        step[30::60] = 1
        for more in range(1, counts):
            step[30 + 60 * more // counts :: 60] = 1
        updates = golden_updates(spec, step)
        moving = updates.rows(~updates.forced & (updates["n_ep1"] > 0))
        assert set(moving["dt_shift"][:3].tolist()) == wanted
        assert moving["n_ep1"][0] == counts


def test_a_steady_count_with_every_end_of_dt_is_the_speed_limit() -> None:
    """From 0.2 ω_lim to ω_lim itself: Table 1 never updates Ndt1 again."""
    step = np.concatenate([pulses(Fraction(5000), 50_001), pulses(Fraction(1000), 50_000)])
    step[:] = 0
    step[1000:50_000:5000] = 1
    step[51_000::1000] = 1
    assert golden_updates(make_spec(1000, estimate="n1"), step).velocity[-1] == 1 << 16


DT, MAX = 40, 25


def seen(step: np.ndarray, **options: object) -> Table:
    return golden_updates(make_spec(DT, MAX, **options), step)


def at_clock(updates: Table, clock: int) -> float:
    """Return the held velocity in counts per dt."""
    row = np.searchsorted(updates.clock, clock, side="right")
    return float(np.append(0, updates.velocity)[row]) / 2**16


def script(*at: tuple[int, int], n: int = 4000) -> np.ndarray:
    step = np.zeros(n, dtype=np.int64)
    for clock, sign in at:
        step[clock] = sign
    return step


def test_reversal_reads_0_until_there_is_a_new_measurement() -> None:
    forward, back = [(100 + 10 * k, 1) for k in range(40)], [(500 + 10 * k, -1) for k in range(40)]
    updates = seen(script(*forward, *back))
    turn = int(np.flatnonzero(updates.clock == 500)[0])
    assert updates.velocity[turn - 1] > 3 << 16
    assert updates.velocity[turn] == 0
    # A window after the turn: 4 counts in dt, from 3 to 4 of them.
    assert updates.clock[turn + 1] == 500 + DT
    assert -(4 << 16) < updates.velocity[turn + 1] < -(3 << 16)
    assert (updates.velocity[turn + 1 : turn + 9] == updates.velocity[turn + 1]).all()


@pytest.mark.parametrize("bound_decay", [True, False])
@pytest.mark.parametrize("gap", [3, 10, 39, 40, 41, 100, 999])
def test_standstill_reads_0_in_time(gap: int, bound_decay: bool) -> None:
    """Never above one count over the time since the last, less a dt to see it by; 0 max_ticks after the last dt."""
    counts = [(100 + gap * k, 1) for k in range(30)]
    last = counts[-1][0]
    updates = seen(script(*counts, n=last + 4000), bound_decay=bound_decay)
    assert updates.velocity[-1] == 0
    assert updates.rests[-1]
    assert updates.forced[-1]
    assert updates.clock[-1] <= last + MAX * DT
    assert np.count_nonzero(updates.rests) == 1
    if bound_decay:
        for clock in range(last + 2 * DT, last + MAX * DT + 10):
            waited = (clock - last) // DT - 1
            assert at_clock(updates, clock) <= 1 / waited, clock
    # The next count only opens a window, which the one after it closes.
    again = seen(script(*counts, (last + 3000, 1), (last + 3000 + 2 * DT, 1), n=last + 3100), bound_decay=bound_decay)
    assert again.clock[-2:].tolist() == [updates.clock[-1], last + 3000 + 2 * DT]
    assert not again.rests[-1]
    assert again["n_dt1"][-1] == 1
    # One that comes just before rest is measured.
    close = script(*counts, (last + DT * (MAX - 1), 1), n=last + DT * MAX)
    assert seen(close, bound_decay=bound_decay).velocity[-1] > 0


@pytest.mark.parametrize("clock", [5, 38, 39, 40, 41, 500, 3000])
def test_one_count_then_silence(clock: int) -> None:
    """It is no speed, when ever it comes; and two of them are one over the time between them."""
    updates = seen(script((clock, 1), n=10_000))
    assert not updates.velocity.any()
    assert updates.rests[-1]
    updates = seen(script((clock, -1), (clock + 2 * DT + 5, -1), n=clock + 3 * DT))
    moving = updates.rows(updates.velocity != 0)
    assert moving.clock.tolist() == [clock + 2 * DT + 5]
    assert moving["n_dt1"].tolist() == [2]


@pytest.mark.parametrize("gap", [1, 2, 13, 39, 40, 41, 80, 200])
def test_dithering_on_one_edge_reads_0_for_ever(gap: int) -> None:
    counts = [(100 + gap * k, -1 if k % 2 else 1) for k in range(300)]
    updates = seen(script((90, -1), *counts, n=100 + 301 * gap))
    after = updates.clock >= 100
    assert after.sum() >= 299
    assert not updates.velocity[after].any()


@pytest.mark.parametrize("target", [Fraction(1, 4), Fraction(1, 30)])
def test_situations_with_an_adaptive_dt(target: Fraction) -> None:
    """A reversal reads 0, and is measured in the shortest dt; rest is seen in time; dithering reads 0 for ever."""
    forward, back = [(100 + 30 * k, 1) for k in range(200)], [(6200 + 30 * k, -1) for k in range(200)]
    dithers = [(13_000 + 50 * k, 1 - 2 * (k % 2)) for k in range(100)]
    burst = [(22_000 + k, 1) for k in range(10)]
    updates = seen(script(*forward, *back, *dithers, *burst, n=26_000), adaptive=target)
    shift = updates["dt_shift"]
    turn = int(np.flatnonzero(updates.clock == 6200)[0])
    assert updates.velocity[turn - 1] > 0 == updates.velocity[turn]
    assert shift[turn - 1] > 0 == shift[turn + 1]
    assert updates.velocity[turn + 1] < 0
    assert updates.clock[turn + 1] <= 6200 + 2 * DT
    inside = (updates.clock >= 13_000) & (updates.clock < 13_000 + 99 * 50)
    assert inside.any()
    assert not updates.velocity[inside].any()
    assert at_clock(updates, 12_170 + MAX * DT) == 0
    assert at_clock(updates, 22_009 + MAX * DT) == 0
    assert updates.rests[-1]
    assert 0 < updates.velocity[updates.clock >= 22_000].max() <= 10 << 16


def test_a_burst_after_standstill() -> None:
    """Ten counts as fast as they can come, at rest before and after."""
    burst = [(5000 + k, 1) for k in range(10)]
    updates = seen(script(*burst, n=9000))
    assert updates.velocity.max() <= 10 << 16
    assert at_clock(updates, 5000 + DT) > 9
    assert at_clock(updates, 5000 + 2 * DT) <= 1
    assert at_clock(updates, 5010 + 4 * DT) <= 1 / 2
    assert at_clock(updates, 5009 + MAX * DT) == 0
    assert updates.rests[-1]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"max_ticks": 2048}, "max_ticks must be from 2 to 2047 with method rairan, not 2048: try --max-time 81.88ms"),
        ({"dt": 4096}, "max_speed must be at most 2048 counts per tick with estimate n3, not 4096"),
        (
            {"dt": 4096, "estimate": "n1", "bounds": True},
            "max_speed must be at most 2048 counts per tick with bounds, not 4096",
        ),
        (
            {"paper_exact": True, "bounds": True},
            "bounds must not be given with paper_exact, whose estimate leaves them",
        ),
        ({"adaptive": Fraction(1, 3)}, "adaptive must be more than 0 and less than 1/3, not 0.333333333"),
        ({"adaptive": Fraction(0)}, "adaptive must be more than 0 and less than 1/3, not 0"),
        (
            {"adaptive": Fraction(1, 10), "paper_exact": True},
            "adaptive must not be given with paper_exact, whose dt is constant",
        ),
        ({"adaptive": Fraction(1, 10), "max_ticks": 3}, "max_ticks must be at least 4 with adaptive, not 3"),
        (
            {"adaptive": Fraction(1, 10), "dt": 1025},
            "max_speed must be at most 1024 counts per tick with adaptive, not 1025",
        ),
        (
            {"adaptive": Fraction(1, 1000), "dt": 4},
            "adaptive must be at least 0.03226 with this speed and time, not 0.001",
        ),
        ({"estimate": "n4"}, "estimate must be one of n1, n2, n3, not 'n4'"),
        (
            {"external_tick": True, "max_tick_cycles": 100},
            "method must not be rairan with an external tick: it makes its own ticks",
        ),
    ],
)
def test_bad_parameters(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}$"):
        make_spec(**({"dt": 40} | parameters))


@pytest.mark.parametrize(
    ("text", "target"), [("0.1%", "1/1000"), ("0.001", "1/1000"), (" 5 %", "1/20"), ("1/8", "1/8")]
)
def test_targets(text: str, target: str) -> None:
    assert parse_target("adaptive", text) == Fraction(target)


@pytest.mark.parametrize("text", ["", "%", "1ms", "a%", "1/0"])
def test_bad_targets(text: str) -> None:
    with pytest.raises(ValueError, match=r"^adaptive must be a fraction such as 0\.1% or 0\.001, not '"):
        parse_target("adaptive", text)


@pytest.mark.parametrize("target", [Fraction(1, 10), Fraction(1, 50), Fraction(1, 200)])
def test_at_a_steady_speed_eq13_is_within_the_target_and_dt_no_longer_than_that_takes(target: Fraction) -> None:
    dt, looked_at, shifts = 48, 0, set()
    spec = make_spec(dt, 300, adaptive=target, max_speed=Speed.parse("5000rev/s"))
    rule, most = spec.form.adaptive_dt, spec.times.max_tick_shift
    assert (spec.tick.max_count, most) == (24, 6)
    for period in np.geomspace(2.1, 2.2 * rule.fewest * dt, 40):
        gap = Fraction(period).limit_denominator(1000)
        step = pulses(gap, int(30 * gap) + (12 * dt << most))
        updates = golden_updates(spec, step)
        looked = updates.clock <= np.flatnonzero(step)[-1]
        looked[: np.count_nonzero(looked) * 2 // 3] = False
        (shift,) = set(updates["dt_shift"][looked].tolist())
        n_ep, n_dt = updates["n_ep1"][looked], updates["n_dt1"][looked]
        error, true = rairan_eq13_max_error(n_ep / n_dt), float(dt / gap)
        # The estimate keeps to the bound, but for a clock and the rounding.
        slack = 1.1 / (dt << shift) + 2**-17 / true
        assert (np.abs(updates.velocity[looked] / 2**16 / true - 1) <= error + slack).all(), gap
        if true * 2**most > rule.fewest or (rule.slow == rule.fewest - 1 and gap > (rule.slow + 1) * dt):
            looked_at += 1
            shifts.add(shift)
            assert (error <= float(target)).all(), gap
            # Half as long, dt has fewer counts than it takes, or the last of them late: in the last half gap.
            assert shift == 0 or true * 2 ** (shift - 1) <= rule.fewest - 0.5 + 0.05, gap
    assert looked_at > 10
    assert len(shifts) > 3


def test_without_n3_the_counts_of_a_tick_are_not_limited() -> None:
    assert isinstance(make_spec(5000, estimate="n1"), RairanTachometer)


@pytest.mark.parametrize("falling", [False, True])
@pytest.mark.parametrize("max_shift", [1, 3, 4, 7])
@pytest.mark.parametrize("one_in", [4, 5, 9, 20, 100])
def test_the_next_k(one_in: int, max_shift: int, falling: bool) -> None:
    target = Fraction(1, one_in)
    rule = AdaptiveDt(target, max_shift)
    for k in range(falling, max_shift + 1):  # from k = 0 on nothing falls
        for n in range(1, 4 * rule.fewest):
            for high in (False, True):
                counts = (n, 1) if high and n > 1 else (1, 1 if high else n)
                wanted = next_k(k, falling, counts, target, max_shift)
                assert next_shift(rule, k, n, high=high, falling=falling) == wanted, (k, n, high)
