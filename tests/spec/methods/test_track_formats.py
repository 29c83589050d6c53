"""Formats of the tracking recursion, computed another way, for cores of all sizes."""

import math
from fractions import Fraction

import numpy as np
import pytest

from tachometry.spec.formats.tracking import Tracking


def drawn(seed: int) -> Tracking:
    """Ticks from 2^8 clocks on, up to a thousand counts in each, bandwidths over five decades."""
    rng = np.random.default_rng(seed)
    external = bool(rng.random() < 0.5)
    tick = int(2 ** rng.uniform(8.2, 17))
    return Tracking(
        clock_hz=int(10 ** rng.uniform(5, 8.2)),
        tick_cycles=tick,
        longest_tick=int(tick * 2 ** rng.uniform(0, 4)) if external else tick,
        max_ticks=int(2 ** rng.uniform(1, 12)),
        max_count=int(2 ** rng.uniform(0, 10)),
        external=external,
        bandwidth=Fraction(10 ** rng.uniform(0, 5)).limit_denominator(1000),
        least_memory=Fraction(rng.uniform(0.5, 0.95)).limit_denominator(100),
        edge_error=Fraction(int(rng.integers(1, 9)), 8),
        agile=bool(rng.random() < 0.5),
        growing=bool(rng.random() < 0.5),
        velocity_bits=int(rng.integers(4, 20)),
        fine_bits=int(rng.integers(1, 16)),
    )


@pytest.mark.parametrize("seed", range(200))
def test_a_word_holds_what_the_program_computes(seed: int) -> None:
    """All in counts and the unit of time U."""
    form = drawn(seed)
    unit, counts, error = 2.0**form.unit_bits, form.max_count, 2 * form.max_count + 2
    assert form.max_error == error
    speed, change = (most / 2.0**form.frac_bits for most in (form.max_velocity, form.max_acceleration))
    assert speed == pytest.approx(counts * unit / form.tick_cycles, rel=1e-3)
    wide, gain = float(form.bandwidth) / form.clock_hz, 1 - float(form.least_memory)
    # U over the gap in which λ·gap is the most that counts, −ln θ.
    per_gap = (4 if form.agile else 1) * wide * unit / -math.log(1 - gain)
    moved = 2 * max(counts, speed * form.longest_tick / unit)
    greatest = max(
        counts * (counts + moved),
        1.25 * speed + 3 * error * gain**2 * per_gap,
        2 * error * gain * 2**form.ratio_range,
        2 * error * gain**2 * per_gap * 2 ** (form.extra_bits + form.ratio_range),
        2 * change,
        2 * speed * max(1.125, 2 ** (form.times_bits - 1) / unit),
        4 * error,
        change + error * gain**3 * per_gap**2 * 2**form.extra_bits,
        2 * error + 2 * moved + 2,
        4 * wide * 2**form.gap_bits,
    )
    dividend = max(form.number_bits + form.mean_bits, form.gap_bits + form.gain_bits - 8)
    assert form.width == 1 + max(math.ceil(math.log2(greatest)) + form.frac_bits, dividend)


@pytest.mark.parametrize("seed", range(200))
def test_the_unit_of_time(seed: int) -> None:
    """As long as possible up to 1/(4·λ_0), but half the longest tick at least."""
    form = drawn(seed)
    unit, most = 2**form.unit_bits, form.clock_hz / (4 * form.bandwidth)
    half = form.longest_tick / 2
    assert unit > half
    assert unit <= most < 2 * unit or (unit > most and unit <= 2 * half)
