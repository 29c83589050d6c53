"""Exactness of base + N/(2^s·m) through the gates."""

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from support.mutant import caught, mutant
from support.quotient import FlatQuotient, every_quotient
from support.sequences import rounded
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import scaler
from tachometry.sim.golden.quotient import round_quotient
from tachometry.spec import Encoder, STachometer, Timing


def default_spec(frac_bits: int = 16, *, cancel: bool = True) -> STachometer:
    timing = Timing.parse("48MHz", "20us", "10ms")
    return STachometer(encoder=Encoder(500), timing=timing, frac_bits=frac_bits, cancel=cancel)


@pytest.mark.parametrize("serial", [True, False])
@pytest.mark.parametrize(("frac_bits", "cancel"), [(16, True), (4, True), (4, False)])
def test_every_numerator_and_interval(tmp_path: Path, frac_bits: int, cancel: bool, serial: bool) -> None:
    spec = default_spec(frac_bits, cancel=cancel)
    numerators = range(-spec.max_numerator, spec.max_numerator + 1)
    base, n, m, got = every_quotient(spec, numerators, spec.tick_to_velocity if serial else 1, tmp_path)
    halvings = spec.reciprocal.halvings
    wanted = (base << frac_bits) + round_quotient(n, m << halvings, frac_bits)
    ties = (n << (frac_bits + 1)) % (m << halvings) == 0
    ties &= (n << frac_bits) % (m << halvings) != 0
    assert len(got) == len(wanted)
    assert np.count_nonzero(got != wanted) == 0
    assert frac_bits != 4 or np.count_nonzero(ties) > 1000


@pytest.mark.parametrize("serial", [True, False])
@pytest.mark.parametrize("towards", [-1, 1])
def test_every_bound(tmp_path: Path, serial: bool, towards: int) -> None:
    """Rounded down and up: at 4 fraction bits many quotients need no rounding at all."""
    spec = default_spec(4)
    numerators = range(-spec.max_numerator, spec.max_numerator + 1)
    base, n, m, got = every_quotient(spec, numerators, spec.tick_to_velocity if serial else 1, tmp_path, towards)
    assert np.count_nonzero(got != (base << 4) + round_quotient(n, 2 * m, 4, towards)) == 0
    assert len(got) == len(n)


def base(n: int) -> int:
    return n % 5 - 3


def check_ties(*, serial: bool) -> None:
    """Ties of both signs, between other values, at 4 fraction bits."""
    spec = default_spec(4)
    pairs = [(n, m) for m in (32, 96, 160, 480) for n in range(-18, 19)] + [(7, 3), (-7, 3), (1920, 1), (-3840, 500)]
    pause = spec.tick_to_velocity if serial else 1
    off = {"load": 0, "start": 0, "enable": 0}
    rows = []
    for n, m in pairs:
        rows += [{"load": 1, "start": 1, "enable": 1, "m": m, "numerator": n, "base": base(n)}] + [off] * (pause - 1)
    seen = clock_by_clock(
        FlatQuotient(spec, serial=serial),
        rows + [off] * (spec.tick_to_velocity + 1),
        ["done", "velocity", "m_out"],
    )
    got = [(row["velocity"], row["m_out"]) for row in seen if row["done"]]
    assert got == [(rounded(Fraction(n, 2 * m) + base(n), 4), m) for n, m in pairs]
    assert seen[spec.tick_to_velocity]["done"] == 1


@pytest.mark.parametrize("serial", [True, False])
def test_ties_base_and_tag(serial: bool) -> None:
    check_ties(serial=serial)


MUTANTS = {
    "half-even rounding": ("(total >> self._surplus)", "((total >> self._surplus) & ~~total[: self._surplus].any())"),
    "the sign bit counts positive": ("self.q ^ sign.replicate(len(self.q))", "self.q"),
    "half down": ("total.eq(self._rounding)", "total.eq(1 << (self._surplus + self._steps - 1))"),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    with mutant(scaler.SerialScaler, *MUTANTS[name]), caught():
        check_ties(serial=True)
