"""Rounded quotients against exact fractions, up to the longest times that a core can measure."""

import math
import random
from fractions import Fraction

import numpy as np
import pytest

from tachometry.sim.golden.methods.timed import rounded
from tachometry.sim.golden.quotient import round_quotient
from tachometry.spec import Encoder, Timing, TTachometer

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
