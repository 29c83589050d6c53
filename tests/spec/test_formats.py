"""Widths and tables of the number formats: the least that hold what they must, each found by trying."""

import math
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import count

import pytest

from tachometry.spec import Encoder, ParameterError, STachometer, Timing
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.low_pass import LowPass


def bits_of(greatest: int) -> int:
    """The least number of bits, unsigned."""
    return next(bits for bits in count() if 2**bits > greatest)


@pytest.mark.parametrize("halvings", [0, 1, 3])
@pytest.mark.parametrize("frac_bits", [4, 5, 8, 11, 16])
@pytest.mark.parametrize("max_numerator", [1, 2, 3, 16, 17, 28])
def test_carried_reciprocal(frac_bits: int, halvings: int, max_numerator: int) -> None:
    form = CarriedReciprocal(5000, max_numerator, frac_bits, halvings, entry=2501)
    scale = 2 ** (frac_bits - halvings)
    assert form.scale == scale
    assert form.depth == next(2**k for k in count() if 4**k >= scale)
    assert form.quotient_width == bits_of(scale)
    assert form.carried_quotient_width == bits_of(scale // form.depth)
    assert form.remainder_width == bits_of(4999) == 13
    assert form.digits == bits_of(max_numerator - 1)
    # The table is left at m = depth, so the largest m in it is one less, and the largest remainder another one.
    assert form.table_remainder_width == bits_of(form.depth - 1)
    assert form.width == form.quotient_width + form.table_remainder_width
    assert len(form.table) == form.depth
    assert form.table[0] == 0
    for m in range(1, form.depth):
        quotient, remainder = form.table[m] % 2**form.quotient_width, form.table[m] >> form.quotient_width
        assert quotient * m + remainder == scale
        assert 0 <= remainder < m
    assert form.presets == {m: (scale // m, scale % m) for m in (form.depth, 2501)}


def test_a_window_that_goes_on_within_the_table_is_no_preset() -> None:
    form = CarriedReciprocal(5000, 4, 16, 0, entry=255)
    assert form.depth == 256
    assert [*form.presets] == [256]


def alpha(bandwidth: Fraction, seconds: Fraction) -> Fraction:
    """1 − e^(−G·T), to 60 digits."""
    with localcontext() as context:
        context.prec = 60
        power = bandwidth * seconds
        return 1 - Fraction((-Decimal(power.numerator) / Decimal(power.denominator)).exp())


@pytest.mark.parametrize("exponent", [5_000_000, 10, 3, 1, Fraction(1, 2), Fraction(1, 3), Fraction(1, 1000), Fraction(1, 10**7)])
def test_extra_bits_are_the_fewest_that_leave_no_dead_zone(exponent: Fraction) -> None:
    # Nothing remains of what was before the longest tick with the fastest filter: α = 1.
    form = LowPass(Fraction(exponent), 255, 20)
    least = alpha(Fraction(exponent), Fraction(1))
    assert form.extra_bits == next(k for k in count(2) if 2**k * least >= 4)
    assert form.factor_bits == 20 + form.extra_bits + 1


@pytest.mark.parametrize(("longest", "tables"), [(1, 1), (255, 1), (1023, 1), (1024, 2), (2047, 2), (8191, 2)])
def test_factors_are_looked_up_in_one_table_or_two(longest: int, tables: int) -> None:
    """Whatever the number of ticks, the product of the entries is e^(−G·m·T), each to the last of its bits."""
    form = LowPass(Fraction(1, 300), longest, 20)
    found = form.tables
    assert len(found) == tables
    one = 2**form.factor_bits
    low = 2**form.low_bits
    assert len(found[0]) == min(low, longest + 1)
    assert tables == 1 or len(found[1]) == longest // low + 1
    # Two tables share the bits evenly, so that they are small together.
    bits = bits_of(longest)
    assert form.low_bits == (bits if tables == 1 else bits - bits // 2)
    steps = (1, low)
    for step, table in zip(steps, found, strict=False):
        for address in {0, 1, 2, len(table) // 2, len(table) - 1} & {*range(len(table))}:
            exact = one * math.exp(-address * step / 300)
            assert table[address] == pytest.approx(min(exact, one - 1), abs=1)
            assert 0 <= table[address] < one
    # Two clocks to begin, p + 2 for each factor, one to add and one to round.
    assert form.latency == 4 + tables * (form.factor_bits + 2)


def filtered(bandwidth: Fraction, cycles: int = 960) -> STachometer:
    return STachometer(encoder=Encoder(500), timing=Timing(48_000_000, cycles, 500), lowpass=bandwidth)


def test_the_slowest_filter() -> None:
    """α is at least 4/2^26, so the state has at most 26 bits more; α is a little less than G·T."""
    seconds = Fraction(960, 48_000_000)
    slowest = 4 / (seconds * 2**26)
    assert filtered(slowest * Fraction(10001, 10000)).low_pass.extra_bits == 26
    assert filtered(slowest * 2).low_pass.extra_bits == 26
    assert filtered(slowest * Fraction(21, 10)).low_pass.extra_bits == 25
    for bandwidth in (slowest * Fraction(9999, 10000), slowest / 2, slowest / 100, Fraction(0), Fraction(-1)):
        with pytest.raises(ParameterError, match=r"^lowpass must be from 0\.00298 to 3\.016e\+08 rad/s here, not "):
            filtered(bandwidth)


def test_the_fastest_filter() -> None:
    """Nothing is faster than the clock: 2π·48 MHz."""
    fastest = Fraction(301_592_894)
    assert filtered(fastest, 1).lowpass == fastest
    with pytest.raises(ParameterError, match=r"^lowpass must be from 2\.861 to 3\.016e\+08 rad/s here, not 301592895"):
        filtered(fastest + 1, 1)
