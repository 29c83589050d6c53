"""Tables of Rairán's method: every entry by the table of bounds in docs/concepts/rairan.md, in exact fractions."""

import math
from fractions import Fraction
from typing import Any

import pytest
from support.rairan import make_spec

from tachometry.spec import RairanTachometer
from tachometry.spec.methods.adaptive import AdaptiveDt

ADAPTIVE = {"adaptive": Fraction(1, 4)}


def down(value: Fraction, f: int) -> int:
    return math.floor(value * 2**f)


def up(value: Fraction, f: int) -> int:
    return math.ceil(value * 2**f)


@pytest.mark.parametrize("frac_bits", [4, 9])
def test_estimates(frac_bits: int) -> None:
    """n1 = 1/d and n2 = 1/(d + 1) to the nearest; the table of n3 is finer, and that of an adaptive dt too."""

    def entries(estimate: str, **options: Any) -> list[int]:
        spec = make_spec(5, 20, estimate=estimate, frac_bits=frac_bits, **options)
        assert spec.form.depth == len(spec.form.table) == 32
        assert spec.words.memory == ("table", 32, max(spec.form.table).bit_length())
        assert spec.form.table[0] == 0
        return list(spec.form.table[1:])

    half = Fraction(1, 2)
    assert entries("n1") == [math.floor(Fraction(2**frac_bits, i) + half) for i in range(1, 32)]
    assert entries("n2") == [math.floor(Fraction(2**frac_bits, i + 1) + half) for i in range(1, 32)]
    assert entries("n3") == [4 * 2**frac_bits // (2 * i + 1) for i in range(1, 32)]
    assert entries("n1", **ADAPTIVE) == [2 * 2**frac_bits // i for i in range(1, 32)]
    assert entries("n2", **ADAPTIVE) == [2 * 2**frac_bits // (i + 1) for i in range(1, 32)]


def test_n3_is_looked_up_by_the_pulses_of_a_tick_too() -> None:
    """By Nep1 − 1, which is at most 7 and 8 here."""
    specs = [make_spec(dt, 3, estimate=estimate) for estimate in ("n1", "n3") for dt in (8, 9)]
    assert [spec.widths.max_pulse_count for spec in specs] == [8, 9] * 2
    assert [spec.form.depth for spec in specs] == [4, 4, 8, 16]


def bounds_of(spec: RairanTachometer, n: int, k: int, high: bool) -> tuple[int, int, int]:
    """Return lower, upper and loose bound of Ndt1 = n, or of Nep1 = n + 1, with dt·2^k; in counts per tick."""
    f, off, none = spec.velocity.frac_bits, spec.bound.edge_error, spec.velocity.absent_bound
    clock = Fraction(1, spec.timing.tick_cycles << k)

    def above(counts: Fraction, time: Fraction) -> int:
        return min(up(counts / time / 2**k, f), none) if time > 0 else none

    if high:
        least = min(down(max(n - off, Fraction(0)) / (1 + clock) / 2**k, f), none)
        return least, above(n + 1 + off, 1 - clock), 0
    if not n:
        return 0, none, 0
    return down((1 - off) / (n + 1 + clock) / 2**k, f), above(1 + off, n - clock), above(off, n - clock)


@pytest.mark.parametrize("edge_error", [Fraction(0), Fraction(1, 4), Fraction(1)])
@pytest.mark.parametrize(("dt", "max_ticks"), [(1, 9), (5, 20), (8, 8), (9, 3)])
def test_bounds(dt: int, max_ticks: int, edge_error: Fraction) -> None:
    spec = make_spec(dt, max_ticks, bounds=True, edge_error=edge_error, frac_bits=7)
    low, high = 1 << max_ticks.bit_length(), next(2**bits for bits in range(9) if 2**bits >= dt)
    assert (spec.form.low_depth, spec.form.high_depth, spec.form.bound_depth) == (low, high, max(low, high))
    wanted = [bounds_of(spec, n, 0, regime) for n in range(max(low, high)) for regime in (False, True)]
    lower, upper, loose = ([row[side] for row in wanted] for side in range(3))
    assert list(spec.form.lower_table) == lower + (loose if edge_error else [])
    assert list(spec.form.upper_table) == upper


@pytest.mark.parametrize("edge_error", [Fraction(0), Fraction(3, 8)])
@pytest.mark.parametrize(("dt", "max_ticks"), [(1, 40), (3, 40), (8, 9), (5, 20)])
def test_bounds_of_an_adaptive_dt(dt: int, max_ticks: int, edge_error: Fraction) -> None:
    """A leading one in the address tells k; it is k places lower for low speeds, and k places higher for high ones."""
    spec = make_spec(dt, max_ticks, bounds=True, edge_error=edge_error, frac_bits=7, **ADAPTIVE)
    assert spec.times.max_tick_shift == max(k for k in range(9) if 2 * 2**k <= max_ticks)
    low, high = 1 << max_ticks.bit_length(), next(2**bits for bits in range(9) if 2**bits >= dt)
    assert spec.form.bound_depth == 2 * max(low, high << spec.times.max_tick_shift)
    tables = [[0] * (2 * spec.form.bound_depth) for _ in range(3)]
    for k in range(spec.times.max_tick_shift + 1):
        assert spec.form.max_dt(k) == max_ticks // 2**k
        for n in range(low >> k):
            for table, value in zip(tables, bounds_of(spec, n, k, False), strict=True):
                table[2 * ((low >> k) + n)] = value
        for n in range(high << k):
            for table, value in zip(tables, bounds_of(spec, n, k, True), strict=True):
                table[2 * ((high << k) + n) + 1] = value
    assert list(spec.form.lower_table) == tables[0] + (tables[2] if edge_error else [])
    assert list(spec.form.upper_table) == tables[1]


@pytest.mark.parametrize("max_ticks", [30, 31, 32, 33, 500])
@pytest.mark.parametrize("options", [{}, ADAPTIVE])
@pytest.mark.parametrize("estimate", ["n1", "n2", "n3"])
def test_a_tie_is_half_an_lsb(estimate: str, options: dict[str, Any], max_ticks: int) -> None:
    spec = make_spec(5, max_ticks, estimate=estimate, frac_bits=4, **options)
    for k in range(spec.times.max_tick_shift + 1):
        of = {"n1": lambda n: Fraction(1, n), "n2": lambda n: Fraction(1, n + 1)}.get(estimate)
        ties = [n for n in range(1, spec.form.max_dt(k) + 1) if of and of(n) / 2**k * 2**4 == Fraction(1, 2)]
        assert spec.form.tie(k) == (ties[0] if ties else None)


@pytest.mark.parametrize("max_shift", range(7))
@pytest.mark.parametrize("one_in", [4, 5, 9, 10, 60])
def test_the_rule_of_an_adaptive_dt(one_in: int, max_shift: int) -> None:
    """S and N of docs/concepts/rairan.md, and the counts from which and up to which k falls."""
    rule = AdaptiveDt(Fraction(1, one_in), max_shift)
    assert rule.fewest == next(n for n in range(2, 99) if Fraction(1, 2 * n - 1) <= Fraction(1, one_in))
    assert rule.slow == min(rule.fewest - 1, math.floor(math.sqrt(2**max_shift)))
    for k in range(max_shift + 1):
        seldom = rule.slow + (k > 0)
        assert rule.slow_from(k) == next(n for n in range(1, 999) if n * 2**k >= seldom)
        if k:
            assert rule.rare_to(k) == max(n for n in range(999) if n * seldom <= 2**k)


def test_the_shortest_maximum_time_of_an_adaptive_dt() -> None:
    spec = make_spec(40, 4, **ADAPTIVE)
    assert (spec.times.max_tick_shift, spec.widths.max_pulse_count, spec.times.update_spacing) == (1, 80, 1)
    # Lengths that wrap, two maximum times, three dt more; all with the longest dt.
    assert spec.recovery.remembered == (8 + 2 * 4 + 3) * 40 * 2
    assert spec.latency.room == 1


def test_the_greatest_dt_of_estimates_that_are_not_rounded() -> None:
    """n1 and n2 of 2^k dt have k fraction bits; with n3, or bounds, 2^k dt have 2048 counts at most."""
    assert [make_spec(5, 2000, estimate=one, frac_bits=4, **ADAPTIVE).times.max_tick_shift for one in ("n1", "n3")] == [
        4,
        8,
    ]
    assert make_spec(1024, 2000, **ADAPTIVE).times.max_tick_shift == 1
    assert make_spec(512, 2000, estimate="n1", bounds=True, **ADAPTIVE).times.max_tick_shift == 2
