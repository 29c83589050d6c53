"""Widths and tables of the number formats: the least that hold what they must, each found by trying."""

import math
from decimal import Decimal, localcontext
from fractions import Fraction
from itertools import count, pairwise, product

import pytest

from tachometry.spec import Encoder, ParameterError, STachometer, Timing
from tachometry.spec.formats.carried_reciprocal import CarriedReciprocal
from tachometry.spec.formats.low_pass import LowPass
from tachometry.spec.formats.reciprocal import (
    DividedReciprocal,
    NarrowReciprocal,
    Reciprocal,
    _odd_neighbours,
    odd_quotient,
)
from tachometry.spec.formats.velocity_output import VelocityOutput


def bits_of(greatest: int) -> int:
    """Return the least number of bits, unsigned."""
    return next(bits for bits in count() if 2**bits > greatest)


def wrong_quotients(form: Reciprocal, q: list[int]) -> int:
    """Return how many N/(2^s·m) come out wrong, to the nearest, down or up; q(m) is that of the list."""
    wrong = 0
    for m, entry in enumerate(q, 1):
        for numerator in range(-form.max_numerator, form.max_numerator + 1):
            twice, by = numerator << (form.frac_bits + 1), m << form.halvings
            nearest, down, up = (twice + by) // (2 * by), twice // (2 * by), -(-twice // (2 * by))
            wanted = {0: nearest, -1: down, 1: up} if form.bounds else {0: nearest}
            wrong += any(
                (numerator * entry + form.rounding(towards)) >> form.scale_bits != right
                for towards, right in wanted.items()
            )
    return wrong


@pytest.mark.parametrize("kind", [Reciprocal, DividedReciprocal])
@pytest.mark.parametrize("bounds", [False, True])
@pytest.mark.parametrize("halvings", [0, 1, 3])
@pytest.mark.parametrize(
    ("max_m", "max_numerator", "frac_bits"), [(1, 1, 4), (12, 7, 4), (16, 5, 7), (17, 16, 0), (33, 31, 4), (40, 33, 5)]
)
def test_reciprocals(
    kind: type[Reciprocal], max_m: int, max_numerator: int, frac_bits: int, halvings: int, bounds: bool
) -> None:
    """N/(2^s·m) comes out right for every m and N, ties included: to the nearest, down and up."""
    form = kind(max_m, max_numerator, frac_bits, halvings, bounds)
    assert len(form.table) == form.depth == next(2**k for k in count() if 2**k >= max_m)
    assert form.width == bits_of(max(form.table)) == bits_of(form.value(1))
    q = [form.table[m % form.depth] for m in range(1, max_m + 1)]
    assert q == [form.value(m) for m in range(1, max_m + 1)]
    assert sum(map(bool, form.table)) == max_m
    assert form.rounding() == form.rounding(0)
    assert wrong_quotients(form, q) == 0
    # The numbers are the nearest, or the odd ones that are nearest.
    step = 2 if kind is DividedReciprocal else 1
    exact = [Fraction(1 << (form.frac_bits + form.guard_bits), m) for m in range(1, max_m + 1)]
    assert all(abs(got - true) <= Fraction(step, 2) for got, true in zip(q, exact, strict=True))
    assert kind is Reciprocal or all(got % 2 for got in q)
    assert form.has_ties == any(
        Fraction(2 * n << frac_bits, m << halvings) % 2 == 1 for m in range(1, max_m + 1) for n in range(1, 400)
    )


@pytest.mark.parametrize("kind", [Reciprocal, DividedReciprocal])
@pytest.mark.parametrize("bounds", [False, True])
def test_a_reciprocal_has_the_fewest_bits_by_its_derivation(kind: type[Reciprocal], bounds: bool) -> None:
    for max_m, frac_bits in ((1, 4), (3, 4), (100, 5), (2047, 10), (2049, 16), (5000, 8)):
        for max_numerator, halvings in product((1, 2, 3, 28, 331), (0, 1, 3, 7)):
            check_fewest_bits(kind(max_m, max_numerator, frac_bits, halvings, bounds))


def check_fewest_bits(form: Reciprocal) -> None:
    """An error of N·δ, and what is added against it, are less than half a unit of N/(2^s·m), or than the whole."""
    m, n, s, bounds = form.max_m, form.max_numerator, form.halvings, form.bounds
    error = Fraction(n, 1 if isinstance(form, DividedReciprocal) else 2)  # |δ| is at most 1, or ½
    digits = next(digits for digits in count(1) if n <= 4**digits // 2 - 1)
    powers = [2**k for k in range(13)]
    ties = any(Fraction(2 * i << form.frac_bits, j << s) % 2 == 1 for j in powers if j <= m for i in powers)
    slack = int("10" * digits, 2) if bounds or ties else 0
    assert (form.digits, form.has_ties, form.slack) == (digits, ties, slack), form
    # What is shifted in with the digits is the same for the ceiling.
    up = next(up for up in count(int(error) + 1) if (up + slack) % 4**digits == 0)
    assert not bounds or form.slack_up == up, form

    def enough(scale: int) -> bool:
        ceiling = not bounds or up + error < Fraction(2**scale, 2**s * m)
        return slack + error < Fraction(2**scale, 2 ** max(s, 1) * m) and ceiling and scale > 2 * digits

    if not (isinstance(form, DividedReciprocal) and form.tried):
        assert form.scale_bits == next(scale for scale in count() if enough(scale)), form


def test_few_divisors_are_tried() -> None:
    """Those of a table, of 2048 entries at most."""
    assert [DividedReciprocal(max_m, 5, 16, 1).tried for max_m in (2048, 2049)] == [True, False]


@pytest.mark.parametrize("halvings", [0, 1, 2])
@pytest.mark.parametrize("max_numerator", [1, 7, 28, 80])
def test_a_division_that_is_tried_has_the_fewest_bits(max_numerator: int, halvings: int) -> None:
    """With a bit less, some quotient is wrong."""
    form = DividedReciprocal(60, max_numerator, 8, halvings)
    assert form.tried
    less = form.guard_bits - 1
    scale = less + halvings

    def right(m: int) -> bool:
        q, by = odd_quotient(8 + less, m), m << halvings
        numbers = range(-max_numerator, max_numerator + 1)
        return all((n * q + (1 << scale - 1)) >> scale == ((n << 9) + by) // (2 * by) for n in numbers)

    assert scale <= 2 * form.digits or not all(map(right, range(1, 61)))


@pytest.mark.parametrize("kind", [Reciprocal, DividedReciprocal, NarrowReciprocal])
def test_every_quotient_of_the_reference(kind: type[Reciprocal]) -> None:
    """500 ticks, 7 counts: |N| ≤ 28 half counts."""
    form = kind(500, 28, 16, 1)
    assert {Reciprocal: (30, 14), DividedReciprocal: (29, 14), NarrowReciprocal: (25, 10)}[kind] == (
        form.width,
        form.scale_bits,
    )
    assert wrong_quotients(form, [form.value(m) for m in range(1, 501)]) == 0


def test_a_sum_of_more_than_40_bits_takes_two_adders_if_the_reciprocal_is_odd() -> None:
    """N·q has 14 bits behind the point of the result, which are dropped."""
    shape = (500, 28, 16, 1)
    assert [DividedReciprocal(*shape).is_wide(width) for width in (26, 27)] == [False, True]
    assert not any(kind(*shape).is_wide(60) for kind in (Reciprocal, NarrowReciprocal))


@pytest.mark.parametrize("halvings", [0, 1, 2])
@pytest.mark.parametrize(
    ("max_m", "max_numerator", "frac_bits"), [(1, 1, 4), (12, 7, 7), (30, 5, 6), (17, 16, 6), (60, 28, 8), (25, 40, 7)]
)
def test_the_narrowest_reciprocal(max_m: int, max_numerator: int, frac_bits: int, halvings: int) -> None:
    """Each q(m) is the least that is right; and with a bit less some m would have none."""
    form = NarrowReciprocal(max_m, max_numerator, frac_bits, halvings)
    assert not form.has_ties
    q = [form.value(m) for m in range(1, max_m + 1)]
    assert wrong_quotients(form, q) == 0

    def right(m: int, entry: int, scale: int) -> bool:
        half, by = 1 << (scale - 1), m << halvings
        return all(
            (n * entry + half) >> scale == ((n << (frac_bits + 1)) + by) // (2 * by)
            for n in range(-max_numerator, max_numerator + 1)
        )

    for m, entry in enumerate(q, 1):
        assert not right(m, entry - 1, form.scale_bits)
    less = form.scale_bits - 1
    nearest = [(1 << (frac_bits + less)) // (m << halvings) for m in range(1, max_m + 1)]
    found = [any(right(m, near + off, less) for off in range(-16, 17)) for m, near in enumerate(nearest, 1)]
    assert not all(found) or less <= 2 * form.digits


@pytest.mark.parametrize("most", [1, 2, 3, 7, 28])
@pytest.mark.parametrize("numerator", [5, 32, 2**16])
def test_neighbours_with_odd_numerators(numerator: int, most: int) -> None:
    for denominator in (1, 2, 3, 7, 27, 499):
        exact = Fraction(numerator, denominator)
        odd = [Fraction(2 * k + 1, n) for n in range(1, most + 1) for k in range(*_around(exact * n))]
        if exact.denominator > most or exact.numerator % 2 == 0:
            below, above = _odd_neighbours(numerator, denominator, most)
            assert Fraction(*below) == max(p for p in odd if p < exact)
            assert Fraction(*above) == min(p for p in odd if p > exact)


def _around(value: Fraction) -> tuple[int, int]:
    return int(value) // 2 - 2, int(value) // 2 + 3


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
    """Return 1 − e^(−G·T), to 60 digits."""
    with localcontext() as context:
        context.prec = 60
        power = bandwidth * seconds
        return 1 - Fraction((-Decimal(power.numerator) / Decimal(power.denominator)).exp())


@pytest.mark.parametrize(
    "exponent", [5_000_000, 10, 3, 1, Fraction(1, 2), Fraction(1, 3), Fraction(1, 1000), Fraction(1, 10**7)]
)
def test_extra_bits_are_the_fewest_that_leave_no_dead_zone(exponent: Fraction) -> None:
    # Nothing remains of what was before the longest tick with the fastest filter: α = 1.
    form = LowPass(Fraction(exponent), 255, 20)
    least = alpha(Fraction(exponent), Fraction(1))
    assert form.extra_bits == next(k for k in count(2) if 2**k * least >= 4)
    assert form.factor_bits == 20 + form.extra_bits + 1


@pytest.mark.parametrize(
    ("longest", "tables"), [(1, 1), (255, 1), (1023, 1), (1024, 2), (2047, 2), (2048, 2), (4095, 2), (8191, 2)]
)
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
            # The nearest, but for 1, which reads all ones.
            exact = one * math.exp(-address * step / 300)
            assert table[address] == (pytest.approx(exact, abs=0.51) if address else one - 1)
    # Two clocks to begin, p + 2 for each factor, one to add and one to round.
    assert form.latency == 4 + tables * (form.factor_bits + 2)


def filtered(bandwidth: Fraction, cycles: int = 960) -> STachometer:
    return STachometer(encoder=Encoder(500), timing=Timing(48_000_000, cycles, 500), lowpass=bandwidth)


def test_the_slowest_filter() -> None:
    """α is at least 4/2^26, so the state has at most 26 bits more; α is a little less than G·T."""
    seconds = Fraction(960, 48_000_000)
    slowest = 4 / (seconds * 2**26)
    assert filtered(slowest * Fraction(10001, 10000)).velocity.low_pass.extra_bits == 26
    assert filtered(slowest * 2).velocity.low_pass.extra_bits == 26
    assert filtered(slowest * Fraction(21, 10)).velocity.low_pass.extra_bits == 25
    for bandwidth in (slowest * Fraction(9999, 10000), slowest / 2, slowest / 100, Fraction(0), Fraction(-1)):
        with pytest.raises(ParameterError, match=r"^lowpass must be from 0\.002981 to 3\.015e\+08 rad/s here, not "):
            filtered(bandwidth)


def test_the_fastest_filter() -> None:
    """Nothing is faster than the clock: 2π·48 MHz."""
    fastest = Fraction(301_592_894)
    assert filtered(fastest, 1).lowpass == fastest
    for told in ("2.862", "3.015e8"):  # see below
        assert filtered(Fraction(told), 1).lowpass == Fraction(told)
    with pytest.raises(ParameterError, match=r"^lowpass must be from 2\.862 to 3\.015e\+08 rad/s here, not 301592895"):
        filtered(fastest + 1, 1)


RATIOS = [
    Fraction(1, 4),
    Fraction(1, 5),
    Fraction(math.pi) / 40,
    Fraction(3, 1000),
    Fraction(255, 1024),
    Fraction(1, 7**9),
]


@pytest.mark.parametrize("max_native", [1, 7, 1000, (1 << 20) - 1, 1 << 20])
@pytest.mark.parametrize("ratio", RATIOS)
def test_another_unit_is_a_constant_product(ratio: Fraction, max_native: int) -> None:
    """Rounding of the multiplier adds at most 1/16 of an LSB, and the output is rounded to the nearest or outward."""
    form = VelocityOutput(ratio, max_native, 40)
    slope = Fraction(form.multiplier, 2**form.shift)
    assert abs(slope - ratio) * max_native <= Fraction(1, 16)
    assert form.multiplier % 2 or not form.shift  # no common factor
    exactly = slope == ratio
    for native in {0, 1, -1, max_native // 2, max_native, -max_native, max_native - 1}:
        exact = ratio * native
        assert form.scaled(native) == math.floor(slope * native + Fraction(1, 2))
        assert abs(form.scaled(native) - exact) <= Fraction(9, 16)
        low, high = form.scaled(native, -1), form.scaled(native, 1)
        assert low <= exact <= high
        assert low > exact - (1 if exactly else Fraction(9, 8))
        assert high < exact + (1 if exactly else Fraction(9, 8))


@pytest.mark.parametrize("ratio", [*RATIOS, Fraction(1)])
def test_the_product_is_a_sum_of_few_shifted_terms(ratio: Fraction) -> None:
    """Signed digits, no two of them next to each other: there is no sum of fewer."""
    form = VelocityOutput(ratio, 12_345, 40)
    assert sum(sign * 2**place for place, sign in form.digits) == form.multiplier
    places = [place for place, _ in form.digits]
    assert all(after - before >= 2 for before, after in pairwise(places))
    assert {sign for _, sign in form.digits} <= {1, -1}
    # One adder: a clock each to clear, to round and to hold. An adder for each digit but the first, else.
    assert form.serial_latency == bits_of(form.multiplier) + 3
    assert form.pipelined_latency == len(places) - 1 + (1 if form.shift else 0) + 1


def test_a_unit_of_its_own_is_only_held_within_its_bits() -> None:
    form = VelocityOutput(Fraction(1), 1000, 9)
    assert (form.multiplier, form.shift, form.digits) == (1, 0, ((0, 1),))
    assert [form.scaled(1000, towards) for towards in (-1, 0, 1)] == [1000] * 3
    assert (form.greatest, form.limit) == (1000, 255)
    assert VelocityOutput(Fraction(1), 1000, 12).limit == 1000
    halves = [VelocityOutput(Fraction(1, 8), 1001, 30, bounds) for bounds in (False, True)]
    assert [form.greatest for form in halves] == [125, 126]
    assert halves[1].rounding() == halves[1].rounding(0) == 2 ** (halves[1].shift - 1)
    nothing = VelocityOutput(Fraction(1, 10**9), 5, 30)
    assert (nothing.multiplier, nothing.shift, nothing.digits, nothing.scaled(5)) == (0, 0, (), 0)
