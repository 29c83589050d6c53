"""Exactness of base + N/(2^s·m) through the gates."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from amaranth.lib import data
from reference.sequences import rounded
from support.nightly import only, only_rows
from support.quotient import FlatQuotient, every_quotient
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import scaler
from tachometry.sim.golden.quotient import round_quotient
from tachometry.spec import Encoder, MTachometer, Speed, STachometer, Timing
from tachometry.spec.formats.reciprocal import DividedReciprocal, NarrowReciprocal, Reciprocal


def default_spec(frac_bits: int = 16, **options: object) -> STachometer:
    timing = Timing.parse("48MHz", "20us", "10ms")
    given: dict[str, object] = {"encoder": Encoder(500), "timing": timing, "frac_bits": frac_bits}
    return STachometer(**(given | options))  # type: ignore[arg-type]


@pytest.mark.parametrize("source", ["serial", "table"])
# One count in each table of reciprocals would do; 4 fraction bits have ties.
@pytest.mark.parametrize(("frac_bits", "cancel"), only_rows([(4, True)], [(16, True), (4, True), (4, False)]))
def test_every_numerator_and_interval(tmp_path: Path, frac_bits: int, cancel: bool, source: str) -> None:
    spec = default_spec(frac_bits, cancel=cancel, reciprocal_source=source)
    assert type(spec.form.reciprocal) is (
        DividedReciprocal if source == "serial" else Reciprocal if frac_bits == 4 else NarrowReciprocal
    )
    # Those of a sixth of the range, and the greatest.
    few = spec.form.max_numerator // 6
    numerators = [*range(-few, few + 1), -spec.form.max_numerator, spec.form.max_numerator]
    base, n, m, got = every_quotient(spec, numerators, tmp_path)
    halvings = spec.form.reciprocal.halvings
    wanted = (base << frac_bits) + round_quotient(n, m << halvings, frac_bits)
    ties = (n << (frac_bits + 1)) % (m << halvings) == 0
    ties &= (n << frac_bits) % (m << halvings) != 0
    assert len(got) == len(wanted)
    assert np.count_nonzero(got != wanted) == 0
    assert frac_bits != 4 or np.count_nonzero(ties) > 1000


# Every source is tried above.
@pytest.mark.parametrize("source", only(["serial"], ["serial", "table"]))
@pytest.mark.parametrize("max_speed", only(["150rad/s"], ["1000rad/s", "150rad/s", "2000rad/s"]))
def test_every_quotient_of_the_reference(tmp_path: Path, max_speed: str, source: str) -> None:
    """All m_s and N, which have 6 bits, 3 and 7: an odd number of bits is a digit more."""
    spec = default_spec(max_speed=Speed.parse(max_speed), reciprocal_source=source)
    assert spec.form.numerator_width == {"1000rad/s": 6, "150rad/s": 4, "2000rad/s": 7}[max_speed]
    numerators = range(-spec.form.max_numerator, spec.form.max_numerator + 1)
    base, n, m, got = every_quotient(spec, numerators, tmp_path)
    assert np.array_equal(got, (base << 16) + round_quotient(n, 2 * m, 16))


@pytest.mark.parametrize("source", only(["table"], ["serial", "table"]))
@pytest.mark.parametrize("towards", only([-1], [-1, 1]))  # up is the mirror of down
def test_every_bound(tmp_path: Path, source: str, towards: int) -> None:
    """Rounded down and up: at 4 fraction bits many quotients need no rounding at all."""
    spec = default_spec(4, reciprocal_source=source, bounds=True, max_speed=Speed.parse("2000rad/s"))
    numerators = range(-spec.form.max_numerator, spec.form.max_numerator + 1)
    base, n, m, got = every_quotient(spec, numerators, tmp_path, towards)
    assert np.count_nonzero(got != (base << 4) + round_quotient(n, 2 * m, 4, towards)) == 0
    assert len(got) == len(n)


def base(n: Any) -> Any:
    return n % 5 - 3


def test_ties_base_and_tag() -> None:
    """Ties of both signs, between other values, at 4 fraction bits."""
    spec = default_spec(4, reciprocal_source="table")
    pairs = [(n, m) for m in (32, 96, 160, 480) for n in range(-18, 19)] + [(7, 3), (-7, 3), (1920, 1), (-3840, 500)]
    assert isinstance(spec.form.reciprocal, Reciprocal)
    pause = spec.form.reciprocal.digits + 4
    off = {"load": 0, "start": 0}
    rows: list[dict[str, int]] = []
    for n, m in pairs:
        rows += [{"m": m} | off] * 2 + [{"load": 1, "numerator": n, "base": base(n)}, {"load": 0, "start": 1}]
        rows += [off] * (pause - 4)
    seen = clock_by_clock(FlatQuotient(spec, serial=True), [*rows, {}, {}], ["done", "velocity", "m_out"])
    found = [(clock, row["velocity"], row["m_out"]) for clock, row in enumerate(seen) if row["done"]]
    wanted = [rounded(Fraction(n, 2 * m) + base(n), 4) for n, m in pairs]
    assert found == [
        (k * pause + 3 + spec.latency.tick_to_velocity, velocity, m)
        for k, (velocity, (_, m)) in enumerate(zip(wanted, pairs, strict=True))
    ]


SERIAL = [(scaler.SerialScaler, "1000rad/s"), (scaler.WideSerialScaler, None)]


@pytest.mark.parametrize(("kind", "max_speed"), SERIAL)
def test_every_bit_of_the_sum_counts(kind: Any, max_speed: str | None) -> None:
    """The sum for odd q that are no reciprocals: those with which it is as near to the next result as it can be."""
    spec = default_spec(max_speed=max_speed and Speed.parse(max_speed))
    form = spec.form.reciprocal
    assert isinstance(form, DividedReciprocal)
    assert form.is_wide(spec.velocity.width) == (kind is scaler.WideSerialScaler)
    base_width, scale = spec.velocity.width - 16, 1 << form.scale_bits
    dut = kind(
        form, base_width=base_width, numerator_width=spec.form.numerator_width, tag=data.StructLayout({"mark": 1})
    )
    rng = np.random.default_rng(1)
    numerators = {sign * int(n) | 1 for n in rng.integers(0, spec.form.max_numerator, 60) for sign in (-1, 1)}
    pairs = [
        (n, (end - form.rounding()) * pow(n, -1, scale) % scale + scale * int(rng.integers(1 << form.width - 23)))
        for n in numerators
        for end in (-1, 1)
    ]
    rows: list[dict[str, int]] = []
    for n, q in pairs:
        rows += [{"load": 1, "start": 0, "numerator": n, "base": base(n), "q": q}, {"load": 0, "start": 1}]
        rows += [{"load": 0, "start": 0}] * (form.digits + 1)
    seen = clock_by_clock(dut, rows, ["results.valid", "results.p.quotient"])
    found = [row["results.p.quotient"] for row in seen if row["results.valid"]]
    assert found == [(base(n) << 16) + ((n * q + form.rounding()) >> form.scale_bits) for n, q in pairs]


def check_wide(tmp_path: Path) -> None:
    """N at the ends of all digits, with every m."""
    spec = default_spec()
    assert isinstance(spec.form.reciprocal, Reciprocal)
    assert spec.form.reciprocal.is_wide(spec.velocity.width)
    ends = [sign * (4**k // 2 + off) for k in range(7) for off in (-1, 0, 1) for sign in (-1, 1)]
    numerators = [*ends, -spec.form.max_numerator, spec.form.max_numerator]
    base, n, m, got = every_quotient(spec, numerators, tmp_path)
    assert np.array_equal(got, (base << 16) + round_quotient(n, 2 * m, 16))


def test_what_is_wide(tmp_path: Path) -> None:
    check_wide(tmp_path)
    assert not any(
        one.form.reciprocal.is_wide(one.velocity.width)  # type: ignore[union-attr]
        for one in (default_spec(max_speed=Speed.parse("1000rad/s")), default_spec(reciprocal_source="table"))
    )


@pytest.mark.parametrize("towards", [-1, 0, 1])
@pytest.mark.parametrize("average", [3, 10])
def test_every_sum_over_a_constant(tmp_path: Path, average: int, towards: int) -> None:
    """The pipelined scaler, as the M method uses it where ticks are short."""
    spec = MTachometer(encoder=Encoder(500), timing=Timing(1000, 2, 10), average=average, frac_bits=4, bounds=True)
    assert not spec.latency.serial
    dut = scaler.PipelinedScaler(
        spec.form.reciprocal,
        base_width=6,
        numerator_width=spec.form.numerator_width,
        tag=data.StructLayout({"mark": 1}),
        towards=towards,
    )
    rows = [
        {"load": 1, "start": 1, "numerator": n, "base": base(n), "q": spec.form.reciprocal.value(average)}
        for n in range(-spec.form.max_numerator, spec.form.max_numerator + 1)
    ]
    seen = clock_by_clock(dut, rows + [{}] * (spec.form.numerator_width + 2), ["results.p.quotient"])
    got = [row["results.p.quotient"] for row in seen[spec.form.numerator_width + 2 :]]
    n = np.arange(-spec.form.max_numerator, spec.form.max_numerator + 1)
    wanted = (base(n) << 4) + round_quotient(n, np.full(len(n), average), 4, towards)
    assert got == wanted.tolist()
