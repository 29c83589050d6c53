"""A velocity in another unit is faithful: less than one LSB from the exact speed."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from tachometry.sim.golden.output import in_unit
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.language.units import PI

REV_PER_UNIT = {"rad/s": 1 / (2 * PI), "rev/s": Fraction(1), "rpm": Fraction(1, 60)}


def updates_of(velocity: np.ndarray) -> Table:
    return Table(np.zeros(len(velocity), dtype=np.int64), {"velocity": velocity})


@pytest.mark.parametrize("unit", REV_PER_UNIT)
@pytest.mark.parametrize("ppr", [1, 500, 4_194_304])
@pytest.mark.parametrize(("tick_cycles", "max_ticks"), [(1, 1 << 20), (960, 500), (1 << 20, 2)])
def test_less_than_one_lsb_from_the_exact_speed(unit: str, ppr: int, tick_cycles: int, max_ticks: int) -> None:
    native = STachometer(encoder=Encoder(ppr), timing=Timing(48_000_000, tick_cycles, max_ticks))
    coarsest, finest = native.velocity.frac_bits_range(unit)
    rng = np.random.default_rng(ppr)
    for frac_bits in {coarsest, finest, finest - 7}:
        spec = STachometer(encoder=native.encoder, timing=native.timing, unit=unit, frac_bits=frac_bits)
        m = rng.integers(1, max_ticks + 1, 300)
        n = rng.integers(-m * spec.tick.max_count, m * spec.tick.max_count + 1)
        m[:2], n[:2] = 1, (spec.tick.max_count, -spec.tick.max_count)
        out = in_unit(spec, updates_of(round_quotient(n, m, spec.velocity.native_frac_bits))).velocity
        # counts per tick → revolutions per second → unit → LSB
        per_tick = 1 / (spec.encoder.counts_per_rev * spec.timing.tick_seconds * REV_PER_UNIT[unit])
        lsb = Fraction(2) ** -frac_bits
        rows = zip(n.tolist(), m.tolist(), out.tolist(), strict=True)
        errors = [abs(Fraction(count, ticks) * per_tick / lsb - raw) for count, ticks, raw in rows]
        assert max(errors) < Fraction(11, 16)
        assert abs(out).max() < 1 << (spec.velocity.width - 1)


@pytest.mark.parametrize("unit", REV_PER_UNIT)
@pytest.mark.parametrize("ppr", [1, 500, 4_194_304])
def test_bounds_stay_bounds(unit: str, ppr: int) -> None:
    """Of a native bound comes one that is no narrower, and wider by less than an LSB and an eighth."""
    spec = STachometer(encoder=Encoder(ppr), timing=Timing(48_000_000, 960, 500), bounds=True)
    spec = replace(spec, unit=unit, frac_bits=spec.velocity.frac_bits_range(unit)[1])
    native = np.random.default_rng(ppr).integers(-spec.velocity.absent_bound, spec.velocity.absent_bound + 1, 1000)
    native[:2] = spec.velocity.absent_bound, -spec.velocity.absent_bound
    bounds = {"velocity_lower": native, "velocity_upper": native, "bounds_valid": native > 0}
    done = in_unit(spec, updates_of(native).having(**bounds))
    per_tick = 1 / (spec.encoder.counts_per_rev * spec.timing.tick_seconds * REV_PER_UNIT[unit])
    scale = per_tick * Fraction(2) ** (spec.velocity.frac_bits - spec.velocity.native_frac_bits)
    rows = zip(native.tolist(), *(done[name].tolist() for name in ("velocity_lower", "velocity_upper")), strict=True)
    for raw, lower, upper in rows:
        assert 0 <= raw * scale - lower < Fraction(9, 8)
        assert 0 <= upper - raw * scale < Fraction(9, 8)
    assert done["velocity_upper"][0] == -done["velocity_lower"][1] == spec.velocity.shown_absent


def test_what_does_not_fit_saturates_and_is_flagged() -> None:
    timing = Timing(1_000_000, 8, 4)
    spec = STachometer(encoder=Encoder(25), timing=timing, frac_bits=4, velocity_width=8)
    done = in_unit(spec, updates_of(np.array([127, 128, -127, -128, 0])))
    assert done.velocity.tolist() == [127, 127, -127, -127, 0]
    assert done.velocity_overflow.tolist() == [False, True, False, True, False]


def test_a_wider_port_never_saturates() -> None:
    spec = STachometer(encoder=Encoder(25), timing=Timing(1_000_000, 8, 4), velocity_width=40)
    assert spec.velocity.width == 40
    assert not in_unit(spec, updates_of(np.array([8 << 16, -8 << 16]))).velocity_overflow.any()
