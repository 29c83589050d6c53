"""The golden control loop against the paper's equations in double precision."""

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Protocol

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim.golden import control
from tachometry.sim.golden.command_generator import Command
from tachometry.sim.golden.control import Control
from tachometry.sim.signals.run import Table
from tachometry.spec import METHODS, Encoder, Speed, STachometer, Timing, of_texts
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.form import POSITION_FRAC_BITS

SOUND_HZ = 50.0


class Loop(Protocol):
    """A controller: speeds in rad/s, angles in rad, currents in A."""

    def update(self, speed: float) -> None: ...
    def tick(self, position: int, speed: float, angle: float) -> float: ...


class Double:
    """The loop of a spec in double precision, as the paper has it, with z itself and exponentials at every update."""

    def __init__(self, spec: LoopSpec) -> None:
        self._spec = spec
        self._seconds = float(spec.units.seconds)
        self._inertia, self._torque_constant = float(spec.inertia), float(spec.torque_constant)
        self._k_p, self._k_v = float(spec.position_gain), float(spec.velocity_gain)
        self._observer, self._limit = float(spec.observer), float(spec.current_limit)
        self._filter = None if spec.filter is None else float(spec.filter)
        self._pitch = 2 * math.pi / spec.tachometer.encoder.counts_per_rev
        self.y = self.z = self._held = self._sum = self._current = 0.0
        self._n = 0

    def _observe(self, n: int, current: float) -> None:
        time = n * self._seconds
        self.y = (
            self._held if self._filter is None else self.y - math.expm1(-self._filter * time) * (self._held - self.y)
        )
        to_speed = self._torque_constant / (self._inertia * self._observer)
        self.z -= math.expm1(-self._observer * time) * (to_speed * current + self.y - self.z)

    def update(self, speed: float) -> None:
        """An update of the velocity."""
        self._held = speed
        if self._spec.synchronised and self._n:
            self._observe(self._n, self._sum / self._n)
            self._sum, self._n = 0.0, 0

    def tick(self, position: int, speed: float, angle: float) -> float:
        """Return a control tick."""
        if not self._spec.synchronised:
            self._observe(1, self._current)
        wanted = self._k_p * (angle - position * self._pitch) + self._k_v * (speed - self.y)
        current = (self._inertia * (wanted + self._observer * (self.z - self.y))) / self._torque_constant
        self._current = max(-self._limit, min(current, self._limit))
        self._sum += self._current
        self._n += 1
        return self._current


class Fixed:
    """The golden model, with the same units."""

    def __init__(self, spec: LoopSpec) -> None:
        self.control = Control(spec.form)
        self._per_speed, self._amperes = 1 / float(spec.units.rad_per_s), float(spec.units.amperes)
        self._command = (1 << spec.form.command_bits) * self._per_speed
        self._turn = spec.tachometer.encoder.counts_per_rev * (1 << POSITION_FRAC_BITS) / (2 * math.pi)

    def update(self, speed: float) -> None:
        """An update of the velocity, which is a whole number of LSB."""
        self.control.update(round(speed * self._per_speed))

    def tick(self, position: int, speed: float, angle: float) -> float:
        """Return a control tick."""
        command = Command(round(angle * self._turn), round(speed * self._command))
        return self.control.tick(position, command) * self._amperes


@dataclass(frozen=True)
class Course:
    """A run: what the shaft did.

    - `error`, `current`, shape (n,), rad/s and A: Speed less the commanded one, and commanded current, at each control
      tick.
    - `seconds`: Of a control tick.
    """

    error: NDArray[np.float64]
    current: NDArray[np.float64]
    seconds: float

    @property
    def rms(self) -> float:
        """RMS of the error."""
        return float(np.sqrt(np.mean(self.error**2)))

    @property
    def sound(self) -> float:
        """RMS of the current above 50 Hz."""
        spectrum = np.abs(np.fft.rfft(self.current - self.current.mean()))
        loud = np.fft.rfftfreq(len(self.current), self.seconds) > SOUND_HZ
        return float(np.sqrt(2 * np.sum(spectrum[loud] ** 2)) / len(self.current))


def run(spec: LoopSpec, loop: Loop, duration: float, seed: int, noise: float = 0.02) -> Course:
    """Return a shaft that follows 200/π·(1 − cos(πt/10)) rad/s with noise of the torque, measured by eq. (21).

    The control period is a tick. The disc's edges are uneven by 0.1 pitch, the driver has 0.1 ms, and the torque has
    white noise of `noise` Nm in each millisecond.
    """
    rng = np.random.default_rng(seed)
    seconds = float(spec.units.seconds)
    n_ticks = round(duration / seconds)
    time = np.arange(n_ticks) * seconds
    commanded = 200 / math.pi * (1 - np.cos(math.pi / 10 * time))
    angles = 200 / math.pi * (time - 10 / math.pi * np.sin(math.pi / 10 * time))
    counts = spec.tachometer.encoder.encoder_counts
    pitch, lsb = 2 * math.pi / counts, float(spec.units.rad_per_s)
    unit = pitch / seconds
    offset = rng.uniform(-0.1, 0.1, counts).tolist()
    torque = np.repeat(noise * rng.standard_normal(round(duration * 1000) + 1), round(1e-3 / seconds))[
        :n_ticks
    ].tolist()
    inertia, constant = float(spec.inertia), float(spec.torque_constant)
    kept, longest = math.exp(-seconds / 1e-4), spec.tachometer.timing.max_ticks
    angle = speed = driven = 0.0
    angle = pitch / 2
    edge = before = offset_count = opened = total = window = 0
    errors, currents = [], []
    for tick, (wanted, target) in enumerate(zip(commanded.tolist(), angles.tolist(), strict=True)):
        m_e = 0
        while angle >= (edge + 1 + offset[(edge + 1) % counts]) * pitch:
            edge, m_e = edge + 1, m_e + 1
        while angle < (edge + offset[edge % counts]) * pitch:
            edge, m_e = edge - 1, m_e - 1
        # Eq. (21), with the alterations of docs/concepts/s-method.md and without the kept half.
        total, window = total + m_e, window + 1
        alters = m_e != before and m_e != offset_count
        if alters or window == longest:
            loop.update(round((total + (opened - m_e) / 2) / window * unit / lsb) * lsb)
            opened, total, window = m_e, 0, 0
        if not alters:
            offset_count = m_e
        before = m_e
        current = loop.tick(edge, wanted, target)
        driven = current + (driven - current) * kept
        faster = speed + (constant * driven + torque[tick]) / inertia * seconds
        angle += (speed + faster) / 2 * seconds
        speed = faster
        errors.append(speed - wanted)
        currents.append(current)
    return Course(np.array(errors), np.array(currents), seconds)


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
