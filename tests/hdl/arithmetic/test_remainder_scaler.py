"""Exactness of long measurements: base + N/(2^s·m) through the carried reciprocal's gates, for every m."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only, only_rows
from support.quotient import FlatQuotient, every_quotient
from support.simulate import clock_by_clock

from tachometry.sim.golden.quotient import round_quotient
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.core.timing import MAX_TICKS
from tachometry.spec.formats.reciprocal import DividedReciprocal


def long_spec(max_ticks: int, frac_bits: int, *, tick_cycles: int = 1, cancel: bool = True) -> STachometer:
    timing = Timing(48_000_000, tick_cycles, max_ticks)
    spec = STachometer(encoder=Encoder(500), timing=timing, frac_bits=frac_bits, cancel=cancel)
    assert spec.form.carried
    return spec


def wanted(spec: STachometer, operands: list[NDArray[np.int64]], towards: int = 0) -> NDArray[np.int64]:
    base, n, m = operands
    return (base << spec.velocity.frac_bits) + round_quotient(
        n, m << spec.form.reciprocal.halvings, spec.velocity.frac_bits, towards
    )


@pytest.mark.parametrize(
    # Of those with ties all; more bits only make digits more.
    ("frac_bits", "cancel"),
    only_rows([(4, True)], [(16, True), (24, True), (4, True), (16, False)]),
)
def test_every_interval_and_numerator_at_a_tick_a_clock(tmp_path: Path, frac_bits: int, cancel: bool) -> None:
    """All N that one count per tick can give, and all m_s to the longest."""
    spec = long_spec(MAX_TICKS, frac_bits, cancel=cancel)
    numerators = range(-spec.form.max_numerator, spec.form.max_numerator + 1)
    *operands, got = every_quotient(spec, numerators, tmp_path)
    assert np.array_equal(got, wanted(spec, operands))


@pytest.mark.parametrize("max_ticks", only([MAX_TICKS], [1 << 16, MAX_TICKS]))
def test_long_measurements_that_are_divided(tmp_path: Path, max_ticks: int) -> None:
    """Every interval up to 2^16, or every 61st up to 2^20, from 960 counts a tick and 24 fraction bits."""
    spec = STachometer(encoder=Encoder(500), timing=Timing(48_000_000, 960, max_ticks), frac_bits=24)
    assert isinstance(spec.form.reciprocal, DividedReciprocal)
    every = 1 if max_ticks < MAX_TICKS else 61
    extreme = spec.form.max_numerator
    *operands, got = every_quotient(spec, [-extreme, 1, extreme], tmp_path, every=every)
    assert np.array_equal(got, wanted(spec, operands))


# Down is the mirror of up; of 20 ticks none is carried, which tests/hdl/arithmetic/test_scaler.py has for all.
@pytest.mark.parametrize("max_ticks", only([4096], [4096, 20]))
@pytest.mark.parametrize("towards", only([-1], [-1, 1]))
def test_every_bound(tmp_path: Path, max_ticks: int, towards: int) -> None:
    """Rounded down and up; with 6 fraction bits many quotients need no rounding at all. Of 20 ticks none is carried."""
    spec = long_spec(max_ticks, 12 if max_ticks == 20 else 6, tick_cycles=2)
    *operands, got = every_quotient(spec, range(-8, 9), tmp_path, towards)
    assert np.array_equal(got, wanted(spec, operands, towards))


# With few fraction bits there are ties; with many the quotient is not yet 0 where the kept half begins.
TIES, CARRIED = 6, 14


def check_starts_over(*, frac_bits: int) -> None:
    """m as in the S method: up, and over again from 1 or, after the longest, from the kept half; N of all sizes."""
    spec = long_spec(2100, frac_bits, tick_cycles=2)
    rng = np.random.default_rng(1)
    m = [*range(1, 300), *range(1, 2101), *range(1051, 1200), *range(1, 20)]
    n = rng.integers(-spec.form.max_numerator, spec.form.max_numerator + 1, len(m))
    base = -(n >> 2)  # for which the ends of the window are within the range of m_e
    # What is started has been loaded the clock before.
    rows = [{"load": 1, "base": b, "numerator": k} for b, k in zip(base.tolist(), n.tolist(), strict=True)]
    begun: list[dict[str, int]] = [{}, *({"start": 1, "moves": 1, "m": k} for k in m)]
    rows = [row | start for row, start in zip([*rows, {}], begun, strict=True)]
    off = [{"load": 0, "start": 0, "moves": 0}]
    seen = clock_by_clock(FlatQuotient(spec, serial=False), rows + off * 40, ["done", "velocity", "m_out"])
    got = [(row["velocity"], row["m_out"]) for row in seen if row["done"]]
    assert got == list(zip(wanted(spec, [base, n, np.array(m)]).tolist(), m, strict=True))


@pytest.mark.parametrize("frac_bits", [TIES, CARRIED])
def test_m_starts_over(frac_bits: int) -> None:
    check_starts_over(frac_bits=frac_bits)
