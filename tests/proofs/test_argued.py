"""Arguments of proofs/mutation/argued.json that can be computed, for all numbers of the core."""

from collections.abc import Callable

import pytest
from proofs.mutation.cases import CASES

from tachometry.spec import STachometer
from tachometry.spec.formats.reciprocal import DividedReciprocal

Bits = Callable[[int, int, int, int], tuple[int, int]]  # the two lowest of a product, from a digit and bit 1 of q


def twice(below: int, low: int, high: int) -> int:
    return (high ^ low) & (1 ^ low ^ below)


def right(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    doubled = twice(below, low, high)
    return 1 - doubled, (1 if doubled else q) ^ (high & (1 - doubled))


def sign_alone(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$56.Y[0] const1`."""
    return right(below, low, high, q)[0], (1 if twice(below, low, high) else q) ^ high


def never_one(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$49.A[0] const1` and `$50.A[0] const0`."""
    return right(below, low, high, q)[0], q ^ (high & (1 - twice(below, low, high)))


def of_low_alone(below: int, low: int, high: int, q: int) -> tuple[int, int]:
    """Return `$65.A[0] const1`: `high` counts as 1 where bit 0 is told."""
    return 1 - twice(below, low, 1), right(below, low, high, q)[1]


def differing(name: str, bits: Bits) -> int:
    """Return for how many N and m_s of a core the quotient is another one with these bits."""
    spec = next(case for case in CASES if case.name == name).spec
    assert isinstance(spec, STachometer)
    form = spec.form.reciprocal
    assert isinstance(form, DividedReciprocal)
    wrong = 0
    for m in range(1, form.max_m + 1):
        q = form.value(m)
        for n in range(-spec.form.max_numerator, spec.form.max_numerator + 1):
            total = form.rounding()
            for place in range(form.digits):
                below, low, high = (((n << 1) >> (2 * place + bit)) & 1 for bit in range(3))
                product = (below + low - 2 * high) * q
                if product:
                    lowest, next_bit = bits(below, low, high, q >> 1 & 1)
                    product = product >> 2 << 2 | next_bit << 1 | lowest
                total += product << 2 * place
            wrong += total >> form.scale_bits != (n * q + form.rounding()) >> form.scale_bits
    return wrong


@pytest.mark.parametrize(
    ("name", "bits"),
    [
        ("s, divided", right),
        ("s, divided, wide", right),
        ("s, divided", sign_alone),
        ("s, divided", never_one),
        ("s, divided, wide", of_low_alone),
    ],
)
def test_the_quotient_is_the_same(name: str, bits: Bits) -> None:
    assert differing(name, bits) == 0


@pytest.mark.parametrize(("name", "bits"), [("s, divided, wide", sign_alone), ("s, divided, wide", never_one)])
def test_it_is_not_where_the_slack_is_less(name: str, bits: Bits) -> None:
    assert differing(name, bits) > 0
