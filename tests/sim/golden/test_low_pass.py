"""The low-pass filter against the exact recursion of eq. (22)."""

import math
from dataclasses import replace
from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from support.nightly import only_rows

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.low_pass import filtered
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, RairanTachometer, Speed, STachometer, Timing

TICK = 128  # clocks, longer than the filter takes
FINE = 120  # bits


def spec_of(lowpass: Fraction, max_ticks: int = 500, frac_bits: int = 16) -> STachometer:
    timing = Timing(48_000_000, 960, max_ticks)
    return STachometer(encoder=Encoder(500), timing=timing, lowpass=lowpass, frac_bits=frac_bits)


def through(spec: STachometer, velocity: np.ndarray, elapsed: np.ndarray, rests: bool = False) -> Table:
    """Return what the filter of a core makes of velocities, each so many ticks after the one before."""
    return filtered(spec, *far_apart(spec, velocity, elapsed, rests))


def far_apart(spec: STachometer, velocity: np.ndarray, elapsed: np.ndarray, rests: bool) -> tuple[Table, Table]:
    came = TICK * np.cumsum(elapsed)
    tick = TICK * np.arange(int(elapsed.sum()))
    columns = {"velocity": velocity, "interval": elapsed, "rests": np.full(len(velocity), rests)}
    return Table(tick, {}), Table(came, columns)


def velocities(spec: STachometer, rng: np.random.Generator, n: int) -> np.ndarray:
    """Return full swings, steps by one LSB, noise; and 0 at the end."""
    most = spec.tick.max_count << spec.velocity.frac_bits
    parts = [
        np.where(np.arange(n) % 40 < 20, most, -most),
        np.full(n, most),
        np.full(n, most - 1),
        rng.integers(-most, most + 1, n),
        rng.integers(-1, 2, n),
    ]
    return np.concatenate([*parts, np.zeros(n, dtype=np.int64)])


def check_faithful(spec: STachometer) -> float:
    """Return the greatest error in LSB."""
    rng = np.random.default_rng(1)
    velocity = velocities(spec, rng, 800)
    longest = spec.timing.max_ticks
    interval = np.where(np.arange(len(velocity)) % 900 < 700, 1, rng.integers(1, longest + 1, len(velocity)))
    got = through(spec, velocity, interval).velocity
    assert len(got) == len(velocity)
    assert spec.lowpass is not None
    exponent = spec.lowpass * spec.timing.tick_seconds
    with localcontext() as context:
        context.prec = 50
        power = Decimal(exponent.numerator) / Decimal(exponent.denominator)
        factors = {m_s: int((-power * m_s).exp() * (1 << FINE)) for m_s in set(interval.tolist())}
    y, worst = 0, 0  # in 2^−FINE
    for u, m_s, raw in zip(velocity.tolist(), interval.tolist(), got.tolist(), strict=True):
        y = (u << FINE) + ((factors[m_s] * (y - (u << FINE))) >> FINE)
        worst = max(worst, abs(y - (raw << FINE)))
    return worst / (1 << FINE)


FORMS = [(500, 16), (500, 4), (5000, 16), (500, 24)]


@pytest.mark.parametrize("lowpass", [Fraction(1, 10), Fraction(20), Fraction(200), Fraction(20_000), Fraction(10**7)])
# The fewest bits, where rounding is the most.
@pytest.mark.parametrize(("max_ticks", "frac_bits"), only_rows([(500, 4)], FORMS))
def test_less_than_an_lsb_from_the_exact_recursion(lowpass: Fraction, max_ticks: int, frac_bits: int) -> None:
    worst = check_faithful(spec_of(lowpass, max_ticks, frac_bits))
    assert worst < 1
    assert worst > 0.4 or lowpass > 10**6  # where the filter lets all through


def test_settles_to_the_last_bit() -> None:
    """No dead zone: of a constant velocity it comes to show just that, and of standstill 0."""
    spec = spec_of(Fraction(20))
    velocity = np.concatenate([np.full(60_000, 12_345), np.zeros(60_000, dtype=np.int64)])
    got = through(spec, velocity, np.ones_like(velocity)).velocity
    assert got[59_999] == 12_345
    assert got[-1] == 0
    assert (np.diff(got[:60_000]) >= 0).all()
    assert (np.diff(got[60_000:]) <= 0).all()


def test_takes_the_last_of_those_that_come_meanwhile_for_the_time_of_all() -> None:
    spec = spec_of(Fraction(2000))
    latency = spec.latency.low_pass
    n = np.array([100, 200, 300, 400]) << 16
    updates = Table(np.array([50, 53, 57, 500]), {"velocity": n, "rests": np.zeros(4, dtype=np.bool_)})
    tick = np.concatenate([np.arange(0, 50, 10), [51, 52, 54, 55, 55, 55], [400]])
    got = filtered(spec, Table(tick, {}), updates)
    assert got.velocity.tolist() == through(spec, n[[0, 2, 3]], np.array([5, 6, 1])).velocity.tolist()
    first = 50 + latency
    assert got.clock.tolist() == [first, first + spec.velocity.low_pass.latency - 2, 500 + latency]


def test_what_comes_when_one_is_taken_waits_for_the_next_turn() -> None:
    """The one before is taken in clock `then`: what comes a clock earlier takes its place, what comes then does not."""
    spec = spec_of(Fraction(2000))
    latency = spec.velocity.low_pass.latency
    then = 51 + latency - 2
    came = np.array([50, 60, then - 1, then, then + 3])
    n = np.array([100, 200, 300, 400, 500]) << 16
    updates = Table(came, {"velocity": n, "rests": np.zeros(5, dtype=np.bool_)})
    tick = np.array([48, 49, 58, 59, 70, 71, then - 1, then + 1, then + 2])  # 2, 2, 2, 1 and 2 for each of them
    got = filtered(spec, Table(tick, {}), updates)
    assert got.velocity.tolist() == through(spec, n[[0, 2, 4]], np.array([2, 4, 3])).velocity.tolist()
    assert got.clock.tolist() == [taken + latency - 1 for taken in (51, then, then + latency - 2)]


@pytest.mark.parametrize("longest", [None, 960, 4800])
def test_time_is_what_has_passed_and_not_what_was_measured(longest: int | None) -> None:
    """Windows that overlap: an update in every tick, of some ticks each, is filtered as one of a tick.

    An external tick counts as 20 µs, the nominal, however long it may be.
    """
    spec = spec_of(Fraction(50))
    if longest is not None:
        spec = replace(spec, external_tick=True, max_tick_cycles=longest)
    n = 1500
    ticks, updates = far_apart(spec, np.full(n, 1000 << 6), np.ones(n, dtype=np.int64), False)
    got = filtered(spec, ticks, updates.having(interval=np.full(n, 77))).velocity
    assert got[-1] == pytest.approx((1000 << 6) * (1 - math.exp(-50 * n * 20e-6)), abs=1)


def test_a_method_without_updates_at_rest_ends_at_0() -> None:
    """Its last update `rests`: no later update would let the velocity decay."""
    rairan = RairanTachometer(
        encoder=Encoder(100), timing=Timing(1_000_000, 100, 50), lowpass=Fraction(100), max_speed=Speed(Fraction(200))
    )
    encoding = VirtualEncoder(100, seed=1).record(parse_motion("constant:50rad/s:20ms+stop:30ms"))
    run = golden.run(rairan, encoding.recording.place(1_000_000)).updates
    assert run.forced[-1]
    assert run.velocity[-1] == 0
    assert run.velocity.max() > 0
    ends = through(spec_of(Fraction(50)), np.array([1 << 16, 0]), np.array([20, 1]), rests=True).velocity
    assert ends[-1] > 0  # others go on, and so does the filter


@pytest.mark.parametrize(("lowpass", "bits"), [(10_000, 3), (1000, 6)])
def test_the_first_update_is_filtered_from_0_and_so_is_the_first_after_rest(lowpass: int, bits: int) -> None:
    """By fractions: y = u + E·(0 − u), rounded to 2^−k and then to an LSB; at rest the state is just 0."""
    rairan = RairanTachometer(
        encoder=Encoder(100),
        timing=Timing(1_000_000, 100, 50),
        lowpass=Fraction(lowpass),
        max_speed=Speed(Fraction(200)),
    )
    form, half = rairan.velocity.low_pass, Fraction(1, 2)
    assert form.extra_bits == bits
    factor = Fraction(form.tables[0][1], 2**form.factor_bits)
    assert factor == pytest.approx(math.exp(-lowpass * 1e-4))

    def wanted(u: int) -> int:
        y = u + math.floor(factor * -u * 2**bits + half) / Fraction(2**bits)
        return math.floor(y + half)

    values = [*range(-100, 100), 77_777]
    velocity = np.array([row for u in values for row in (u, 0)])
    ticks, updates = far_apart(spec_of(Fraction(1)), velocity, np.ones_like(velocity), False)
    updates.columns["rests"][1::2] = True
    assert filtered(rairan, ticks, updates).velocity.tolist() == [row for u in values for row in (wanted(u), 0)]
    for u in range(1, 10):
        ticks, updates = far_apart(spec_of(Fraction(1)), np.array([u]), np.array([1]), False)
        assert filtered(rairan, ticks, updates).velocity.tolist() == [wanted(u)]
