"""The units of a loop in the manifest are those in which the golden loop works."""

import json
import math
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from support.control import USUAL

from tachometry.sim.golden.command_generator import Command, Demand, Generator
from tachometry.sim.golden.control import Control
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.generator import CONSTANT, RAMP, SINE
from tachometry.spec.registers.manifest import manifest

COUNTS = 2000  # a revolution
INERTIA, CONSTANT_OF_TORQUE, K_P, K_V, OBSERVER = 2e-4, 0.05, 900.0, 70.0, 250.0
SPEC = replace(
    USUAL,
    inertia=Fraction("2e-4"),
    torque_constant=Fraction("0.05"),
    position_gain=Fraction(900),
    velocity_gain=Fraction(70),
    observer=Fraction(250),
    velocity_filter=Fraction(0),
    current_limit=Fraction(12),
)
IN_RAD_PER_S = replace(USUAL.tachometer, unit="rad/s", frac_bits=6)
SPECS = [SPEC, replace(SPEC, tachometer=IN_RAD_PER_S, multiplier="parallel", control_period=480)]


def described(spec: LoopSpec) -> dict[str, Any]:
    """Return entries of the manifest, as whoever reads the file has them."""
    found: dict[str, Any] = json.loads(json.dumps(manifest(spec, "wheel")))["loop"]
    return found


def amperes(spec: LoopSpec, command: Command) -> float:
    """Return the current of a control tick at rest."""
    entry = described(spec)["current"]
    loop = Control(spec.form)
    loop.tick(0, command)
    assert not loop.saturated
    return float(loop.current * entry["amperes_per_lsb"])


@pytest.mark.parametrize("spec", SPECS)
def test_commands_and_current(spec: LoopSpec) -> None:
    """The current is J/K_t·(a + k_v·v + k_p·θ), of an acceleration, a velocity and a way to go."""
    entries = described(spec)
    raw = {"position": 70_000, "velocity": 30_000, "acceleration": 200_000}
    per_lsb = {
        "position": K_P * entries["command_position"]["counts_per_lsb"] * 2 * math.pi / COUNTS,
        "velocity": K_V * entries["command_velocity"]["rad_per_s_per_lsb"],
        "acceleration": entries["command_acceleration"]["rad_per_s2_per_lsb"],
    }
    for name, value in raw.items():
        size = value
        while INERTIA / CONSTANT_OF_TORQUE * per_lsb[name] * size > 11:  # within the limit
            size //= 2
        for signed in (size, -size // 3):
            wanted = INERTIA / CONSTANT_OF_TORQUE * per_lsb[name] * signed
            assert abs(wanted) > 0.02
            command: dict[str, Any] = {name: signed}
            assert amperes(spec, Command(**command)) == pytest.approx(wanted, rel=1e-3, abs=6e-4)
    limit = entries["current"]["limit"] * entries["current"]["amperes_per_lsb"]
    assert limit == pytest.approx(12, abs=entries["current"]["amperes_per_lsb"])


@pytest.mark.parametrize("spec", SPECS)
def test_velocity_and_disturbance(spec: LoopSpec) -> None:
    """The velocity is that of the tachometer; a current that moves nothing is a torque that holds it."""
    entries, loop = described(spec), Control(spec.form)
    loop.tick(0, Command())
    loop.update(1234)
    loop.tick(0, Command())
    per_lsb = float(manifest(spec, "wheel")["velocity"]["rad_per_s_per_lsb"])
    assert loop.y * entries["filtered_velocity"]["rad_per_s_per_lsb"] == pytest.approx(1234 * per_lsb)
    loop = Control(spec.form)
    held = Command(acceleration=int(5 * CONSTANT_OF_TORQUE / INERTIA * 2**spec.units.acceleration_frac_bits))
    currents = []
    for _ in range(12):  # the observer lags, so it is not all that is found in a few ticks
        loop.tick(0, held)
        currents.append(loop.current * entries["current"]["amperes_per_lsb"])
        loop.update(0)
    # dw/dt = ω·(T − w), from a tick to the next, T the torque of the current before.
    torque = 0.0
    for current in currents[:-1]:
        torque += (current * CONSTANT_OF_TORQUE - torque) * -math.expm1(-OBSERVER * float(spec.units.seconds))
    assert abs(torque) > 1e-3
    assert loop.w * entries["disturbance"]["torque_per_lsb"] == pytest.approx(torque, rel=2e-3)


@pytest.mark.parametrize("spec", SPECS)
def test_the_demands_of_a_generator(spec: LoopSpec) -> None:
    """A velocity is a way per control tick, an acceleration a change of it; a sine has its frequency and amplitude."""
    entries = described(spec)["generator"]
    position = described(spec)["command_position"]["counts_per_lsb"]

    def gone(demand: Demand, n: int) -> list[float]:
        """Return position in counts after each control tick."""
        generator, found = Generator(spec.generator), []
        for _ in range(n):
            generator.tick(0, demand)
            found.append(generator.command().position * position)
        return found

    (way,) = gone(Demand(CONSTANT, 1 << 30), 1)
    assert way == pytest.approx(entries["velocity"]["counts_per_tick_per_lsb"] * (1 << 30), abs=position)
    ramp = gone(Demand(RAMP, 1 << 30, 1 << 30), 4)
    change = entries["acceleration"]["counts_per_tick2_per_lsb"] * (1 << 30)
    assert ramp == pytest.approx([change * n * (n + 1) / 2 for n in (1, 2, 3, 4)], abs=2 * position)
    periods = 400
    rate = round(4 * math.sin(math.pi / periods) ** 2 / entries["rate"]["per_lsb"])
    sine = gone(Demand(SINE, amplitude=round(100 / entries["amplitude"]["counts_per_lsb"]), rate=rate), 3 * periods)
    assert max(sine) == pytest.approx(200, rel=1e-3)
    assert sine[::periods] == pytest.approx([0, 0, 0], abs=0.1)


def test_gains_that_are_inputs() -> None:
    """An LSB of k_p and of k_v, and of the parts of acceleration and disturbance."""
    for spec in (replace(one, gains="inputs", command="ports") for one in SPECS):
        gains = described(spec)["gains"]
        for name, option in {"position": K_P, "velocity": K_V, "acceleration": 1, "disturbance": 1}.items():
            entry = gains[f"gain_{name}"]
            assert entry["option"] * entry["per_lsb"] == pytest.approx(option, rel=1e-3)
            assert entry["most"] * entry["per_lsb"] > 15.9 * option
