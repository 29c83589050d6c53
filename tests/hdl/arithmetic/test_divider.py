"""The serial divider: every quotient at small widths, and some at large ones."""

from collections.abc import Sequence

import numpy as np
import pytest
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import divider
from tachometry.hdl.arithmetic.reciprocal import DividedReciprocal, LookedUpReciprocal
from tachometry.spec.formats import reciprocal as spec

OUTPUTS = ["done", "by", "running", "digit", "last"]


def check(
    integer_bits: int, scale_bits: int, divisor_width: int, cases: Sequence[tuple[int, int]], zeros: int | None = None
) -> None:
    """Each case as soon as the last is done, the first of all with the last digit of one that comes to nothing.

    `zeros`: bits at the end of each dividend that are 0, where quotients are rounded to the nearest integer. Of each
    dividend a part comes as its addend.
    """
    dut = divider.Divider(
        divisor_width=divisor_width,
        integer_bits=integer_bits,
        scale_bits=scale_bits,
        nearest=zeros is not None,
        zeros=zeros or 0,
    )
    digits = integer_bits + scale_bits + 1
    clocks = digits + 1
    rows = [{"start": 1, "dividend": 0, "divisor": 1}, *[{"start": 0}] * (digits - 1)]
    first = len(rows)
    rng = np.random.default_rng(1)
    for dividend, by in cases:
        addend = int(rng.integers(-abs(dividend), abs(dividend) + 1)) >> (zeros or 0) << (zeros or 0)
        parts = {"dividend": dividend - addend, "addend": addend, "divisor": by}
        rows += [{"start": 1, **parts}, *[{"start": 0}] * (clocks - 1)]
    outputs = OUTPUTS if zeros is not None else [*OUTPUTS, "quotient"]
    seen = clock_by_clock(dut, [*rows, {"start": 0}, {}], outputs)
    done = [clock for clock, row in enumerate(seen) if row["done"]]
    assert done == [first + (k + 1) * clocks for k in range(len(cases))]
    running = [clock for clock, row in enumerate(seen) if row["running"]]
    assert running == [*range(1, first + 1), *(clock - digits + k for clock in done for k in range(digits))]
    expected = [((dividend << scale_bits) + (by // 2 if zeros is not None else 0)) // by for dividend, by in cases]
    assert [clock for clock in running if seen[clock]["last"]] == [first, *(clock - 1 for clock in done)]
    assert [seen[clock]["by"] for clock in done] == [by for _, by in cases]
    if zeros is None:
        assert [seen[clock]["quotient"] for clock in (*done, done[-1] + 1)] == [*expected, expected[-1]]  # it is held
    found = [sum(seen[clock - 1 - k]["digit"] << k for k in range(digits)) for clock in done]
    assert found == [quotient + (1 << (digits - 1)) for quotient in expected]


SMALL = [(2, 3, 3), (1, 4, 4), (3, 1, 2), (4, 2, 1)]


@pytest.mark.parametrize(("integer_bits", "scale_bits", "divisor_width"), SMALL)
def test_every_quotient(integer_bits: int, scale_bits: int, divisor_width: int) -> None:
    cases = [
        (dividend, by)
        for by in range(1, 1 << divisor_width)
        for dividend in range(1 - (by << integer_bits), by << integer_bits)
    ]
    check(integer_bits, scale_bits, divisor_width, cases)


@pytest.mark.parametrize("zeros", [0, 1, 2, 3])
@pytest.mark.parametrize(("integer_bits", "scale_bits", "divisor_width"), SMALL)
def test_nearest_integer(integer_bits: int, scale_bits: int, divisor_width: int, zeros: int) -> None:
    cases = [
        (dividend, by)
        for by in range(1, 1 << divisor_width)
        for dividend in range(1 - (by << integer_bits), by << integer_bits)
        if dividend % (1 << zeros) == 0 and (dividend << scale_bits) + by // 2 < by << (integer_bits + scale_bits)
    ]
    check(integer_bits, scale_bits, divisor_width, cases, zeros)


def test_wide_quotients() -> None:
    rng = np.random.default_rng(1)
    by = [1, (1 << 20) - 1, *rng.integers(1, 1 << 20, 60).tolist(), *rng.integers(1, 1 << 6, 60).tolist()]
    cases = [(int(rng.integers(1 - (n << 10), n << 10)), n) for n in by]
    cases += [(sign * ((n << 10) - 1), n) for n in by[:4] for sign in (1, -1)]
    check(10, 25, 20, cases)
    check(10, 25, 20, [(4 * int(rng.integers(1 - (n << 7), n << 7)), n) for n in by], 2)


@pytest.mark.parametrize("nearest", [False, True])
@pytest.mark.parametrize(("integer_bits", "scale_bits", "divisor_width"), [(3, 2, 3), (3, 1, 4), (4, 2, 3)])
def test_the_second_digit_tells_a_quotient_of_too_many(
    integer_bits: int, scale_bits: int, divisor_width: int, nearest: bool
) -> None:
    dut = divider.Divider(
        divisor_width=divisor_width, integer_bits=integer_bits, scale_bits=scale_bits, nearest=nearest
    )
    most = 1 << (divisor_width + integer_bits - 1)
    cases = [
        (dividend, by)
        for by in range(1, 1 << divisor_width)
        for dividend in range(-most, most)
        if not -(by << integer_bits) <= dividend < by << integer_bits
    ]
    rows = [row for dividend, by in cases for row in ({"start": 1, "dividend": dividend, "divisor": by}, {"start": 0})]
    seen = [row["digit"] for row in clock_by_clock(dut, [*rows, {"start": 0}, {"start": 0}], ["digit"])]
    positive = [int(dividend >= 0) for dividend, _ in cases]
    assert (len(cases) > 90, seen[1:-2:2], seen[2:-1:2]) == (True, positive, positive)


@pytest.mark.parametrize("max_m", [2, 3, 64, 65])
def test_every_reciprocal_two_clocks_after_m(max_m: int) -> None:
    described = spec.Reciprocal(max_m, max_numerator=28, frac_bits=8, halvings=1)
    rows = [{"m": m} for m in range(1, max_m + 1)] + [{}, {}]
    seen = [row["q"] for row in clock_by_clock(LookedUpReciprocal(described), rows, ["q"])]
    assert seen[2:] == [described.value(m) for m in range(1, max_m + 1)]


@pytest.mark.parametrize("max_m", [2, 13, 32])
def test_every_division(max_m: int) -> None:
    """From the reset on, and then from each move on; a move in the midst of a division begins anew."""
    described = spec.DividedReciprocal(max_m, max_numerator=7, frac_bits=4, halvings=1)
    clocks = described.steps + 2
    rows: list[dict[str, int]] = [{"m": 1, "moves": 0}] * (clocks - 1)
    for m in range(1, max_m + 1):
        rows += [{"moves": 1}, *[{"m": m, "moves": 0}] * (clocks - 1)]
        if m % 5 == 0:
            rows += [{"moves": 1}, *[{"m": 1, "moves": 0}] * 3]
    seen = clock_by_clock(DividedReciprocal(described), [*rows, {}, {}], ["q"])
    moves = [0, *(clock for clock, row in enumerate(rows) if row["moves"])]
    held = 0
    for before, after in zip(moves, [*moves[1:], len(rows)], strict=True):
        for clock in range(before + clocks - (before == 0), after + 1):
            assert seen[clock]["q"] == described.value(rows[clock - 1]["m"]), clock
            held += 1
    assert held > max_m
