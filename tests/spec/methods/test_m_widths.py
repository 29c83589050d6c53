"""Widths and latencies of the M method, by small numbers."""

from fractions import Fraction
from typing import Any

import pytest

from tachometry.spec import Encoder, MTachometer, Timing


def make_spec(average: int, frac_bits: int = 16, tick: int = 20, **options: Any) -> MTachometer:
    timing = Timing(1_000_000, tick, 10)
    return MTachometer(encoder=Encoder(8), timing=timing, average=average, frac_bits=frac_bits, **options)


@pytest.mark.parametrize("frac_bits", [4, 8])
@pytest.mark.parametrize("average", [1, 2, 3, 4, 5, 8, 16, 32, 64, 256])
def test_a_mean_is_a_shift_where_it_is_a_number_of_the_format(average: int, frac_bits: int) -> None:
    exact = 2**frac_bits % average == 0
    spec = make_spec(average, frac_bits)
    assert spec.form.shift == (frac_bits - average.bit_length() + 1 if exact else None)
    assert spec.latency.datapath == (1 if exact else (spec.form.numerator_width + 1) // 2 + 3)


@pytest.mark.parametrize(("eighths", "parts"), [(0, 1), (8, 1), (4, 2), (2, 4), (6, 4), (1, 8), (3, 8)])
@pytest.mark.parametrize("average", [3, 4, 8, 16])
def test_bounds_take_parts_of_a_count(average: int, eighths: int, parts: int) -> None:
    """A count more or less, and the edge error: in parts of a count that make a whole number of both."""
    spec = make_spec(average, 5, bounds=True, edge_error=Fraction(eighths, 8))
    margin = (1 + Fraction(eighths, 8)) * parts
    assert 1 << spec.bound.error_bits == parts
    assert spec.form.margin == margin
    assert spec.form.max_sum == 20 * average
    assert spec.form.max_numerator == 20 * average * parts + margin
    shifts = average != 3 and 2**5 % (average * parts) == 0
    assert (spec.form.shift is not None) == shifts
    # One clock for the sum, one for each two bits, two more for the scaler.
    bits = (20 * average * parts + int(margin)).bit_length() + 1
    assert spec.form.numerator_width == bits
    assert spec.latency.datapath == (1 if shifts else (bits + 1) // 2 + 3)


def test_without_bounds_there_is_no_margin() -> None:
    spec = make_spec(3)
    assert (spec.form.max_numerator, spec.form.numerator_width, spec.form.sum_width, spec.widths.interval) == (
        60,
        7,
        7,
        2,
    )
    assert (spec.times.standstill_ticks, spec.recovery.remembered) == (3, 4 * 20)


def test_one_adder_is_enough_if_a_tick_is_long() -> None:
    """The numerator of 3 ticks of 4 clocks has 5 bits, and an adder a clock more to do than it has digits."""
    assert [make_spec(3, tick=tick).latency.serial for tick in (3, 4, 5)] == [False, True, True]
    assert [make_spec(3, tick=tick).latency.datapath for tick in (3, 4)] == [5 + 3, 3 + 3]
    assert not make_spec(4).latency.serial
    # Ticks from outside may come in half the time; of 10 clocks the numerator has 6 bits.
    external = [
        make_spec(3, tick=tick, external_tick=True, max_tick_cycles=tick).latency.serial for tick in (4, 7, 8, 10)
    ]
    assert external == [False, False, True, True]
