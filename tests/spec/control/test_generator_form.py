"""Formats of the command generator: what they must hold, computed from the speeds and accelerations of a shaft."""

import math
from dataclasses import replace
from fractions import Fraction

import pytest
from support.control import OFTEN, USUAL

from tachometry.spec import Encoder, Speed, Timing
from tachometry.spec.control.generator import generator_clocks

CORE = USUAL.tachometer
SLOW = replace(CORE, encoder=Encoder(20_000), timing=Timing.parse("48MHz", "1ms", "100ms"))
SPECS = [
    USUAL,
    OFTEN,
    replace(USUAL, tachometer=replace(CORE, max_speed=None)),
    replace(USUAL, tachometer=replace(SLOW, max_speed=Speed.parse("3rad/s")), inertia=Fraction(1)),
    replace(USUAL, tachometer=replace(SLOW, max_speed=Speed.parse("3000rad/s")), inertia=Fraction(1, 10**7)),
]


def bits_of(*values: int) -> int:
    """Return bits of a signed word that holds these and the negative ones."""
    return max(value.bit_length() for value in values) + 1


@pytest.mark.parametrize("number", range(len(SPECS)))
def test_what_the_formats_hold(number: int) -> None:
    spec = SPECS[number]
    form, shown = spec.generator, 8  # fraction bits of the commanded position
    count, tick = 2 * math.pi / spec.tachometer.encoder.counts_per_rev, float(spec.units.seconds)
    # The greatest acceleration of its port fits a bound of 32 bits, and half of it, with as fine a fraction as may be.
    greatest = 2**19 / 2**spec.units.acceleration_frac_bits / count * tick**2  # counts per control tick squared
    assert shown <= form.fraction <= 36
    if form.fraction > shown:
        assert greatest * 2**form.fraction <= 2**31 * (1 + 1e-9)
    if form.fraction < 36:
        assert greatest * 2 ** (form.fraction + 1) > 2**31 * (1 - 1e-9)
    # A velocity is the greatest that the tachometer shows, or one of 32 bits.
    lsb = float(spec.tachometer.velocity.rad_per_s_per_lsb)
    fastest = math.ceil(spec.tachometer.velocity.full_scale * lsb / count * tick * 2**form.fraction * (1 - 1e-12))
    assert form.velocity_bits == max(31, fastest.bit_length())
    assert form.velocity_shift == form.velocity_bits - 31
    assert form.most_velocity == 2**form.velocity_bits - 1
    # The way to the middle of a sine is up to twice the greatest amplitude, 2^27 of its LSB.
    assert form.most_away == 2 ** (28 + form.fraction - shown) - 1
    away = form.most_away >> 6
    # A velocity changes to the opposite one, of 32 bits; a step of a sine is less than a 64th of the way.
    change = bits_of(form.most_velocity + (2**31 << form.velocity_shift))
    assert form.change_width == max(change, bits_of(away) + 1)
    assert form.place_width == spec.tachometer.position_width + form.fraction
    words = [bits_of(away)]
    for width, scale in ((bits_of(form.most_velocity), form.velocity), (form.change_width, form.acceleration)):
        words.append(width - scale.shift)
        assert 2**27 <= scale.factor <= 2**28
    assert form.word_width == max(words)
    velocity = count / tick / 2**form.fraction / float(spec.units.rad_per_s) * 2**spec.units.command_bits
    acceleration = count / tick**2 / 2**form.fraction * 2**spec.units.acceleration_frac_bits
    for scale, ratio in ((form.velocity, velocity), (form.acceleration, acceleration)):
        assert scale.factor / 2.0 ** (32 + scale.shift) == pytest.approx(ratio, rel=2**-27)
    assert form.acceleration_width == 20
    assert form.command_width == spec.tachometer.velocity.width + spec.units.command_bits


def test_the_clocks_of_a_step() -> None:
    """Three products, of 33 clocks or of 3, and five clocks: behind the first one, and between the others."""
    assert [generator_clocks(one) for one in ("serial", "parallel")] == [3 * 33 + 5, 3 * 3 + 5]
