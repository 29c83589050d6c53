"""A motor under a controller, in Python: to compare controllers, not to be exact."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.command_generator import Command
from tachometry.sim.golden.control import Control
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

    Parameters
    ----------
    error, current : float64 array, shape (n,), rad/s and A
        Speed less the commanded one, and commanded current, at each control tick.
    seconds : float
        Of a control tick.
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
    counts = spec.tachometer.encoder.counts_per_rev
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
