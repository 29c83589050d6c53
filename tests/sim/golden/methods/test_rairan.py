"""The golden model of Rairán's method: against Table 1 to the letter, and against its description, clock by clock."""

from fractions import Fraction

import numpy as np
import pytest
from papers.rairan_equations import rairan_eq13_max_error
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


def script(*at: tuple[int, int], n: int = 4000) -> np.ndarray:
    step = np.zeros(n, dtype=np.int64)
    for clock, sign in at:
        step[clock] = sign
    return step


@pytest.mark.parametrize(
    ("text", "target"), [("0.1%", "1/1000"), ("0.001", "1/1000"), (" 5 %", "1/20"), ("1/8", "1/8")]
)
def test_targets(text: str, target: str) -> None:
    assert parse_target("adaptive", text) == Fraction(target)


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
