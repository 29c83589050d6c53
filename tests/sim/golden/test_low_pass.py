"""The low-pass filter against the exact recursion of eq. (22)."""

from decimal import Decimal, localcontext
from fractions import Fraction

import numpy as np
import pytest
from support.mutant import caught, mutant

from tachometry.sim.golden.low_pass import filtered
from tachometry.sim.results import Updates
from tachometry.spec import Encoder, STachometer, Timing, low_pass

FAR_APART = 1 << 12  # clocks
FINE = 120  # bits


def spec_of(lowpass: Fraction, max_ticks: int = 500, frac_bits: int = 16) -> STachometer:
    timing = Timing(48_000_000, 960, max_ticks)
    return STachometer(encoder=Encoder(500), timing=timing, lowpass=lowpass, frac_bits=frac_bits)


def updates_of(velocity: np.ndarray, interval: np.ndarray) -> Updates:
    none = np.zeros(len(velocity), dtype=np.bool_)
    return Updates(FAR_APART * (1 + np.arange(len(velocity))), velocity, interval, none, none, none)


def velocities(spec: STachometer, rng: np.random.Generator, n: int) -> np.ndarray:
    """Full swings, steps by one LSB, noise; and 0 at the end."""
    most = spec.max_count << spec.frac_bits
    parts = [
        np.where(np.arange(n) % 40 < 20, most, -most),
        np.full(n, most),
        np.full(n, most - 1),
        rng.integers(-most, most + 1, n),
        rng.integers(-1, 2, n),
    ]
    return np.concatenate([*parts, np.zeros(n, dtype=np.int64)])


def check_faithful(spec: STachometer) -> float:
    """The greatest error in LSB."""
    rng = np.random.default_rng(1)
    velocity = velocities(spec, rng, 800)
    longest = spec.timing.max_ticks
    interval = np.where(np.arange(len(velocity)) % 900 < 700, 1, rng.integers(1, longest + 1, len(velocity)))
    got = filtered(spec, updates_of(velocity, interval), 1 << 40).velocity
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


@pytest.mark.parametrize("lowpass", [Fraction(1, 10), Fraction(20), Fraction(200), Fraction(20_000), Fraction(10**7)])
@pytest.mark.parametrize(("max_ticks", "frac_bits"), [(500, 16), (500, 4), (1 << 16, 16), (500, 24)])
def test_less_than_an_lsb_from_the_exact_recursion(lowpass: Fraction, max_ticks: int, frac_bits: int) -> None:
    worst = check_faithful(spec_of(lowpass, max_ticks, frac_bits))
    assert worst < 1
    assert worst > 0.4 or lowpass > 10**6  # where the filter lets all through


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("self.native_width + self.extra_bits + 1", "self.native_width"),
        ("e^(−exponent·intervals) to 60 digits.", 'short."""\n        intervals += 1\n        """'),
    ],
)
def test_mutants_are_caught(right: str, wrong: str) -> None:
    with mutant(low_pass.LowPass, right, wrong), caught():
        assert check_faithful(spec_of(Fraction(20))) < 1


def check_settles() -> None:
    spec = spec_of(Fraction(20))
    velocity = np.concatenate([np.full(60_000, 12_345), np.zeros(60_000, dtype=np.int64)])
    got = filtered(spec, updates_of(velocity, np.ones_like(velocity)), 1 << 40).velocity
    assert got[59_999] == 12_345
    assert got[-1] == 0
    assert (np.diff(got[:60_000]) >= 0).all()
    assert (np.diff(got[60_000:]) <= 0).all()


def test_settles_to_the_last_bit() -> None:
    """No dead zone: of a constant velocity it comes to show just that, and of standstill 0."""
    check_settles()
    with mutant(low_pass.LowPass, "least * (1 << k) < 4", "least * (1 << k) < 0.1"), caught():
        check_settles()


def test_takes_the_last_of_those_that_come_meanwhile_for_the_time_of_all() -> None:
    spec = spec_of(Fraction(2000))
    first = spec.low_pass_latency + spec.output_latency
    n = np.array([100, 200, 300, 400]) << 16
    none = np.zeros(4, dtype=np.bool_)
    close = Updates(first + np.array([0, 3, 7, 500]), n, np.array([5, 2, 4, 1]), none, none, none)
    apart = updates_of(n[[0, 2, 3]], np.array([5, 6, 1]))
    got = filtered(spec, close, 1 << 40)
    assert got.velocity.tolist() == filtered(spec, apart, 1 << 40).velocity.tolist()
    assert got.interval.tolist() == [5, 4, 1]
    assert got.clock.tolist() == [first, first + spec.low_pass.latency - 2, first + 500]
