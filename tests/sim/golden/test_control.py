"""The golden control loop against the paper's equations in double precision."""

import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from support.shaft import Double, Fixed, run

from tachometry.sim.golden import control
from tachometry.sim.golden.control import Command
from tachometry.sim.signals.run import Table
from tachometry.spec import METHODS, Encoder, Speed, STachometer, Timing, of_texts
from tachometry.spec.control import LoopSpec

CORE = STachometer(
    encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), max_speed=Speed.parse("1000rad/s")
)


def loop(gain: int, **options: Any) -> LoopSpec:
    """Return the gains of Fig. 15."""
    rest = {"position_gain": Fraction(gain**2, 4), "observer": Fraction(2 * gain)} | options
    return LoopSpec(tachometer=CORE, velocity_gain=Fraction(gain), **rest)


def check_side_by_side(spec: LoopSpec) -> None:
    """Given the same updates, positions and commands both have the same y, z and currents, whatever the limit does."""
    rng = np.random.default_rng(5)
    fixed, double = control_of(spec), Double(spec)
    lsb, amperes = float(spec.units.rad_per_s), float(spec.units.amperes)
    unit = lsb / 2**spec.form.extra_bits
    pitch = 2 * math.pi / CORE.encoder.counts_per_rev
    errors = []
    speed = 30.0
    for tick in range(4000):
        speed += 0.02 * rng.standard_normal()
        # Updates from one in every tick to one in 10 ms.
        if rng.random() < (1.0, 0.1, 0.004)[tick // 300 % 3]:
            raw = round((speed + 0.1 * rng.standard_normal()) / lsb)
            fixed.control.update(raw)
            double.update(raw * lsb)
        position = round(tick * 20e-6 * 30 / pitch)
        angle = (position * 256 + int(rng.integers(-200, 200))) / 256 * pitch
        # The disturbance observer drives the current into the limit now and then.
        wanted = fixed.tick(position, 30.0, angle) - double.tick(position, 30.0, angle)
        errors.append((fixed.control.y * unit - double.y, fixed.control.z * unit - double.z, wanted))
    y, z, current = np.abs(np.array(errors)).max(axis=0)
    # A coefficient is off by 2^-12 of it, and roundings add up to 3/8 LSB in z.
    assert y < lsb / 8 + 2**-12 * 2
    assert z < lsb / 2 + 2**-12 * 30
    steepness = float(spec.inertia / spec.torque_constant) * float(spec.velocity_gain + spec.observer)
    assert current < amperes + steepness * (y + z) + 2**-12 * 20


@pytest.mark.parametrize("method", METHODS)
def test_only_an_update_of_tracking_may_be_no_measurement(method: str) -> None:
    """Such as the one of a tick without a count."""
    core = of_texts(method, {"ppr": "500", "max-speed": "1000rad/s"})
    spec, clock = LoopSpec(tachometer=core), np.arange(0, 48_000, 4800)

    def filtered(forced: int) -> list[int]:
        columns = {"velocity": np.arange(10) << 12, "forced": np.full(10, forced)}
        shown = control.control(spec, clock, np.zeros_like(clock), Table(clock + 1, columns), [Command()] * 10)
        return shown["filtered_velocity"].tolist()

    assert (filtered(0) == filtered(1)) == (method != "track")


def control_of(spec: LoopSpec) -> Fixed:
    """Make the golden model."""
    fixed = Fixed(spec)
    fixed.control = control.Control(spec.form)
    return fixed


SPECS = {
    "synchronised": loop(80),
    "conventional": loop(80, synchronised=False),
    "no filter": loop(40, velocity_filter=Fraction(0)),
    "two filters": loop(160, velocity_filter=Fraction(500)),
    "no position": loop(20, position_gain=Fraction(0)),
}


@pytest.mark.parametrize("name", SPECS)
def test_the_same_as_in_double_precision(name: str) -> None:
    check_side_by_side(SPECS[name])


def test_an_update_takes_part_after_its_clock() -> None:
    """The one in the clock of a control tick has not come for that tick."""
    clock, nowhere = np.array([1000, 2000, 3000]), np.zeros(3, np.int64)
    updates = Table(np.array([2000]), {"velocity": np.array([500])})
    rows = control.control(SPECS["conventional"], clock, nowhere, updates, [control.Command()] * 3)
    assert (rows.filtered_velocity != 0).tolist() == [False, False, True]


def test_a_shaft_follows() -> None:
    """In the loop both have the same errors, but for chance: an update a tick later takes another course."""
    spec = loop(160)
    found = np.array(
        [
            [(one.rms, one.sound) for one in (run(spec, Fixed(spec), 0.5, seed), run(spec, Double(spec), 0.5, seed))]
            for seed in range(3)
        ]
    )
    fixed, double = found.mean(axis=0)
    assert fixed == pytest.approx(double, rel=0.1)
    conventional = replace(spec, synchronised=False)
    assert run(conventional, Fixed(conventional), 0.5, 0).sound > 1.3 * fixed[1]
