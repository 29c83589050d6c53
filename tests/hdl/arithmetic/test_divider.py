"""The serial divider: every quotient at small widths, and some at large ones."""

from collections.abc import Sequence

import numpy as np
import pytest
from support.mutant import caught, mutant
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import divider
from tachometry.hdl.arithmetic.divider import Divider

OUTPUTS = ["done", "quotient", "by", "busy"]


def check(integer_bits: int, scale_bits: int, divisor_width: int, cases: Sequence[tuple[int, int]]) -> None:
    """Each case as soon as the last is done, the first of all after a start that comes to nothing."""
    dut = divider.Divider(divisor_width=divisor_width, integer_bits=integer_bits, scale_bits=scale_bits)
    clocks = integer_bits + scale_bits + 1
    rows = [{"start": 1, "dividend": 0, "divisor": 1}, *[{"start": 0}] * (clocks // 2)]
    first = len(rows)
    for dividend, by in cases:
        rows += [{"start": 1, "dividend": dividend, "divisor": by}, *[{"start": 0}] * (clocks - 1)]
    seen = clock_by_clock(dut, [*rows, {"start": 0}, {}], OUTPUTS)
    assert [clock for clock, row in enumerate(seen) if row["done"]] == [
        first + (k + 1) * clocks for k in range(len(cases))
    ]
    assert [row["busy"] for row in seen] == [0] + [1] * (len(seen) - 2) + [0]
    got = [(row["quotient"], row["by"]) for row in seen if row["done"]]
    assert got == [((dividend << scale_bits) // by, by) for dividend, by in cases]


SMALL = [(2, 3, 3), (1, 4, 4), (3, 1, 2), (4, 2, 1)]


@pytest.mark.parametrize(("integer_bits", "scale_bits", "divisor_width"), SMALL)
def test_every_quotient(integer_bits: int, scale_bits: int, divisor_width: int) -> None:
    cases = [
        (dividend, by)
        for by in range(1, 1 << divisor_width)
        for dividend in range(1 - (by << integer_bits), by << integer_bits)
    ]
    check(integer_bits, scale_bits, divisor_width, cases)


def test_wide_quotients() -> None:
    rng = np.random.default_rng(1)
    by = [1, (1 << 20) - 1, *rng.integers(1, 1 << 20, 60).tolist(), *rng.integers(1, 1 << 6, 60).tolist()]
    cases = [(int(rng.integers(1 - (n << 10), n << 10)), n) for n in by]
    cases += [(sign * ((n << 10) - 1), n) for n in by[:4] for sign in (1, -1)]
    check(10, 25, 20, cases)


MUTANTS = {
    "restoring nothing": ("(~negative).replicate", "Const(1).replicate"),
    "no digit of the dividend": ("Cat(1, left[-1], remainder)", "Cat(1, 0, remainder)"),
    "first sign inverted": ("~digits[-1])", "digits[-1])"),
    "no correction": ("Cat(~negative, digits[:-1]", "Cat(1, digits[:-1]"),
    "a step too many": ("steps.eq(self._steps - 1)", "steps.eq(self._steps)"),
    "not stopped": ("running.eq(0)", "running.eq(1)"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    with mutant(Divider, *MUTANTS[name]), caught():
        check(2, 3, 3, [(dividend, by) for by in (1, 3, 7) for dividend in range(1 - 4 * by, 4 * by)])
