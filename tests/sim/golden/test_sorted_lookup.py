"""Places in ordered arrays against binary searches, and rounded quotients against exact fractions."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim.golden.methods.timed import rounded
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.golden.sorted_lookup import next_place, not_before, places, spans
from tachometry.spec import Encoder, Timing, TTachometer

NONE = np.empty(0, dtype=np.int64)


def ordered(rng: np.random.Generator, n: int, most: int) -> NDArray[np.int64]:
    """Return so many different numbers, in order."""
    return np.cumsum(rng.integers(1, most + 1, n)) - 5


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("n", [0, 1, 2, 3, 50])
def test_places_are_those_of_a_search(n: int, side: str) -> None:
    """Among evenly spaced numbers, and among those of which only the first two, or all but one, are."""
    rng = np.random.default_rng(n)
    values = np.arange(-30, 300)
    for step in (1, 2, 7):
        even = 3 + step * np.arange(n)
        late, gap = even.copy(), even.copy()
        late[n // 2 + 1 :] += 1
        gap[n // 2 : n // 2 + 1] += step // 2
        for numbers in (even, late, gap, ordered(rng, n, 9)):
            found = places(numbers, values, side)
            assert found.tolist() == [int(np.searchsorted(numbers, value, side)) for value in values]  # type: ignore[call-overload]


def test_next_places() -> None:
    assert next_place(np.array([0, 2, 3]), 6).tolist() == [2, 2, 3, 6, 6, 6]
    assert next_place(NONE, 3).tolist() == [3, 3, 3]
    assert next_place(NONE, 0).tolist() == []


@pytest.mark.parametrize("seed", range(5))
def test_the_first_place_that_is_not_before(seed: int) -> None:
    """Few places on and many."""
    rng = np.random.default_rng(seed)
    clock = ordered(rng, 80, 4)
    for wait in (0, 1, 3, 8, 40, 1000):
        found = not_before(clock, clock + wait).tolist()
        assert found == [max(k + 1, int(np.searchsorted(clock, clock[k] + wait))) for k in range(80)]
    assert not_before(NONE, NONE).tolist() == []
    assert not_before(clock[:1], clock[:1] + 1).tolist() == [1]


def test_spans() -> None:
    numbers, row = spans(np.array([3, 10, 5, 7]), np.array([6, 10, 4, 9]))
    assert numbers.tolist() == [3, 4, 5, 7, 8]
    assert row.tolist() == [0, 0, 0, 3, 3]
    assert [column.tolist() for column in spans(NONE, NONE)] == [[], []]


ROUND = {0: lambda x: math.floor(x + Fraction(1, 2)), -1: math.floor, 1: math.ceil}


@pytest.mark.parametrize("towards", ROUND)
@pytest.mark.parametrize("frac_bits", [0, 1, 10, 24, 40])
@pytest.mark.parametrize("longest", [8, 1 << 20, 1 << 37, 1 << 41, (1 << 61) - 1])
def test_quotients_are_exact(longest: int, frac_bits: int, towards: int) -> None:
    draw = random.Random(f"{longest} {frac_bits}")
    denominators = [1, 2, longest, longest - 1] + [draw.randint(1, longest) for _ in range(50)]
    greatest = min((1 << 61) - 1, (1 << 61 - frac_bits))
    pairs = [(draw.randint(-min(greatest * d, 1 << 61), min(greatest * d, 1 << 61)), d) for d in denominators]
    pairs += [(sign * (d // 2 + k), d) for d in denominators for sign in (1, -1) for k in (-1, 0, 1)]  # ties
    n, d = np.array(pairs).T
    expected = [ROUND[towards](Fraction(numerator << frac_bits, denominator)) for numerator, denominator in pairs]
    assert round_quotient(n, d, frac_bits, towards).tolist() == expected


def test_the_longest_time_with_the_most_fraction_bits() -> None:
    """At 2^40 clocks and 24 fraction bits a product of both needs more than 64 bits."""
    spec = TTachometer(encoder=Encoder(1), timing=Timing(48_000_000, 1 << 20, 1 << 20), frac_bits=24)
    time = np.array([(1 << 40) - k for k in range(5)] + [(1 << 39) + 1, 3])
    velocity, saturated = rounded(spec, np.full(len(time), 3), time)
    expected = [ROUND[0](Fraction(3 << 20 << 23, int(t))) for t in time]
    assert velocity.tolist() == expected
    assert not saturated.any()
