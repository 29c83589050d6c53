"""The golden command generator against what a shaft would do, in double precision."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.control import OFTEN, USUAL

from tachometry.sim.golden import command_generator
from tachometry.sim.golden.command_generator import Command, Demand
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.generator import CONSTANT, RAMP, RATE_FRAC_BITS, SINE, GeneratorForm

FORM = USUAL.generator


def states(form: GeneratorForm, demands: list[Demand], position: int = 0) -> np.ndarray:
    """Return place, speed and change in each control tick, in counts and control ticks."""
    generator = command_generator.Generator(form)
    found = []
    for demand in [Demand(enable=False), *demands]:
        generator.tick(position, demand)
        found.append((generator.place, generator.speed, generator.change))
    return np.array(found, dtype=np.int64)


def check_sine(hertz: float, amplitude: float, n: int) -> None:
    """A sine is one for ever, and place and speed are sums, in every bit."""
    turn = math.pi * hertz * float(USUAL.units.seconds)
    rate = round(4 * math.sin(turn) ** 2 * 2**RATE_FRAC_BITS)
    angle = 2 * math.asin(math.sqrt(rate / 2**RATE_FRAC_BITS) / 2)
    found = states(FORM, [Demand(SINE, amplitude=round(amplitude * 256), rate=rate)] * n, 7)
    place, speed, change = found.T
    assert np.array_equal(np.diff(place), speed[1:])
    assert np.array_equal(np.diff(speed), change[1:])
    # It begins with the second of these, for which there is no step.
    k = np.arange(n)
    wanted = 7 + amplitude * (1 - np.cos((k + 0.5) * angle) / math.cos(angle / 2))
    assert np.abs(place[1:] / 2**FORM.fraction - wanted).max() < 1e-5 * abs(amplitude)


@pytest.mark.parametrize(("hertz", "amplitude"), [(2, 1000), (40, -3.5), (900, 20)])
def test_a_sine(hertz: float, amplitude: float) -> None:
    check_sine(hertz, amplitude, 30_000)


def test_a_ramp() -> None:
    """It takes as long as it must, and goes no faster."""
    wanted = 3 << 22
    demands = [Demand(RAMP, wanted, 1 << 24)] * 300 + [Demand(CONSTANT, -wanted)] * 2 + [Demand(RAMP, 5, 1 << 25)] * 200
    _, speed, change = states(FORM, demands).T
    target = wanted << FORM.velocity_shift
    steps = -(-target // (1 << 24))
    assert (change[1:steps] == 1 << 24).all()
    assert speed[min(steps, 300)] == min(target, 300 << 24)
    assert speed[301] == -target
    assert change[301] == -target - speed[300]
    assert change[303] == min(1 << 25, (5 << FORM.velocity_shift) + target)


@pytest.mark.parametrize("spec", [USUAL, OFTEN])
def test_the_commands_are_in_the_units_of_the_ports(spec: LoopSpec) -> None:
    """To half an LSB, and a sixteenth; where control ticks are close, an LSB of the acceleration is less than one."""
    form = spec.generator
    assert (form.acceleration.shift < 0) == (spec is OFTEN)
    count = 2 * math.pi / spec.tachometer.encoder.counts_per_rev
    tick, velocity = float(spec.units.seconds), float(spec.units.rad_per_s / (1 << spec.units.command_bits))
    most = (1 << 19) - 1
    generator = command_generator.Generator(form)
    for raw, bound in ((123_456_789, 1 << 30), (-1_000_000_007, 87_000), (3, 1000), (-2_000_000, 7), (5, 1 << 31)):
        generator.tick(0, Demand(RAMP, raw, bound))
        command = generator.command()
        speed = generator.speed / 2**form.fraction * count / tick / velocity
        assert command.velocity == pytest.approx(speed, abs=0.57)
        change = generator.change / 2**form.fraction * count / tick**2 * 2.0**spec.units.acceleration_frac_bits
        assert command.acceleration == pytest.approx(np.clip(change, -most, most), abs=0.57)
        assert abs(command.acceleration) < most or bound > 1 << 20


def test_nothing_is_demanded_but_what_is_told() -> None:
    """A demand is for rest, and a command is to be followed, at rest and at 0, where nothing else is told."""
    assert Command() == Command(position=0, velocity=0, acceleration=0, enable=True)
    assert Demand() == Demand(mode=CONSTANT, velocity=0, acceleration=0, amplitude=0, rate=0, enable=True)
    generator = command_generator.Generator(FORM)
    generator.tick(0, Demand())
    assert generator.command() == Command()


def test_a_sine_begins_at_rest_from_the_start_and_where_it_was_disabled() -> None:
    """At one end: the first step is none. A disabled generator is where the shaft is, at rest."""
    generator = command_generator.Generator(FORM)
    sine = Demand(SINE, amplitude=1000, rate=1 << 31)
    generator.tick(0, sine)
    assert (generator.place, generator.speed, generator.change) == (0, 0, 0)
    generator.tick(0, sine)
    assert generator.speed > 0
    generator.tick(5, Demand(CONSTANT, 77, enable=False))
    assert (generator.place, generator.speed, generator.change) == (5 << FORM.fraction, 0, 0)
    generator.tick(5, sine)
    assert generator.speed == 0
    generator.tick(5, Demand(CONSTANT, 1 << 20))
    assert generator.speed == 1 << 20 + FORM.velocity_shift
    generator.tick(5, sine)
    assert generator.speed == 0


def test_nothing_overflows() -> None:
    """The fastest sine of the greatest amplitude stays within the bounds of the velocity."""
    form = replace(FORM, velocity_bits=40, velocity_shift=9)
    demands = [Demand(SINE, amplitude=-1 << 27, rate=(1 << 32) - 1)] * 100 + [Demand(SINE, rate=0)] * 5
    _, speed, _ = states(form, demands).T
    assert np.abs(speed).max() == form.most_velocity
