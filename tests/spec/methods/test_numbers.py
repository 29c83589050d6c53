"""Times and widths of T, M/T, S and M, by small numbers that can be told by hand; numbers.json says how."""

import json
from fractions import Fraction
from functools import reduce
from pathlib import Path

import pytest

from tachometry.spec import Encoder, MTachometer, TachometerSpec, Timing, of_texts

BASE = {"ppr": "8", "clock": "1MHz", "tick": "20clk", "max-time": "200clk", "frac-bits": "4"}
CORES = json.loads(Path(__file__).with_name("numbers.json").read_text(encoding="utf-8"))


def core(words: str) -> TachometerSpec:
    method, *more = words.split()
    return of_texts(method, BASE | dict(word.split("=") for word in more))


def number(spec: TachometerSpec, path: str) -> object:
    found = reduce(getattr, path.split("."), spec)
    if isinstance(found, tuple):
        return len(found) if path.endswith("digits") else list(found)
    return found if found is None or isinstance(found, int | str) else type(found).__name__


@pytest.mark.parametrize(("words", "why", "numbers"), CORES, ids=[words for words, *_ in CORES])
def test_numbers(words: str, why: str, numbers: dict[str, object]) -> None:
    spec = core(words)
    assert {path: number(spec, path) for path in numbers} == numbers, why


def make_spec(average: int, frac_bits: int = 16, tick: int = 20, **options: object) -> MTachometer:
    timing = Timing(1_000_000, tick, 10)
    return MTachometer(encoder=Encoder(8), timing=timing, average=average, frac_bits=frac_bits, **options)  # type: ignore[arg-type]


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
