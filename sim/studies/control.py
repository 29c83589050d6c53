"""A velocity loop about a core: what Tsuji 2009, Sec. VII, does with a motor, and what is measured of it."""

import math
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Course, Edges, Gains, LoopSimulation, Motor

_PERIOD = 1e-3  # s, of the tables of a course
_PASSAGES = 1 << 16
_SOUND_HZ = 50.0


class Command(Protocol):
    """A commanded speed: any `Motion` is one."""

    @property
    def duration(self) -> float: ...
    def speed(self, t: FloatArray) -> FloatArray: ...


@dataclass(frozen=True, kw_only=True)
class Task:
    """What the shaft is to do, and what disturbs it.

    Parameters
    ----------
    motion : Command
        The commanded speed, and by its integral the commanded angle.
    load : float, Nm
        Against the motion, for `load_seconds` from `load_from` on.
    load_from, load_seconds : float, s
    noise : float, Nm rms
        Of the torque: Gaussian, a new value every millisecond.
    """

    motion: Command
    load: float = 0.0
    load_from: float = 0.0
    load_seconds: float = 0.0
    noise: float = 0.0

    def course(self, seed: int) -> Course:
        """The tables of a run."""
        time = np.arange(math.ceil(self.motion.duration / _PERIOD - 1e-9) + 1) * _PERIOD
        time = np.minimum(time, self.motion.duration)
        load = self.noise * np.random.default_rng([seed, 1]).standard_normal(len(time))
        load += self.load * ((time >= self.load_from) & (time < self.load_from + self.load_seconds))
        speed = self.motion.speed(time)
        # The integral of what is drawn between two values, so that speed and angle agree.
        angle = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * _PERIOD))
        return Course(seconds=_PERIOD, speed=speed, angle=angle, load=load)


def edges_of(encoder: VirtualEncoder) -> Edges:
    """The disc of a virtual encoder, and its jitter as a displacement of each passage."""
    jitter = encoder.jitter * np.random.default_rng([encoder.seed, 2]).standard_normal(_PASSAGES)
    return Edges(np.asarray(encoder.disc.offset), np.clip(jitter, -0.4, 0.4))


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Figures of a run, from a time on.

    Parameters
    ----------
    rms, largest : float, rad/s
        Of the shaft's true speed less the commanded one.
    sound : float, A rms
        Of the commanded current, above 50 Hz: what is heard.
    shown : float, rad/s
        Largest deviation of the speed as the paper shows it, see `as_shown`.
    """

    rms: float
    largest: float
    sound: float
    shown: float


def as_shown(log: dict[str, FloatArray], rad_per_count: float, rate: float = 30.0, period: float = 1e-3) -> FloatArray:
    """The speed by the M method every `period` through a low-pass filter of `rate` rad/s, as in Figs. 13 and 14."""
    every = round(period / (log["time"][1] - log["time"][0]))
    measured = np.diff(log["position"][::every], prepend=0.0) * rad_per_count / period
    kept, found, state = math.exp(-rate * period), [], 0.0
    for value in measured.tolist():
        state = value + (state - value) * kept
        found.append(state)
    return np.array(found)


def outcome(log: dict[str, FloatArray], rad_per_count: float, begin: float = 0.0) -> Outcome:
    """What came of a run, from `begin` (s) on."""
    late = log["time"] >= begin
    error = (log["speed"] - log["command"])[late]
    current, spacing = log["current"][late], float(log["time"][1] - log["time"][0])
    spectrum = np.abs(np.fft.rfft(current - current.mean()))
    loud = np.fft.rfftfreq(len(current), spacing) > _SOUND_HZ
    shown = as_shown(log, rad_per_count)
    every = len(log["time"]) / len(shown)
    wanted = log["command"][np.minimum((np.arange(len(shown)) * every).astype(int), len(log["command"]) - 1)]
    seen = np.arange(len(shown)) * every * spacing >= begin
    return Outcome(
        rms=float(np.sqrt(np.mean(error**2))),
        largest=float(np.abs(error).max()),
        sound=float(np.sqrt(2 * np.sum(spectrum[loud] ** 2)) / len(current)),
        shown=float(np.abs(shown - wanted)[seen].max()),
    )


def dip(log: dict[str, FloatArray], begin: float, seconds: float) -> float:
    """The largest deviation of the true speed within a time after a load has come, less the mean before it: rad/s."""
    time, error = log["time"], log["speed"] - log["command"]
    before = error[(time >= begin - seconds) & (time < begin)].mean()
    return float(np.abs(error[(time >= begin) & (time < begin + seconds)] - before).max())


def seeded(encoder: VirtualEncoder, seed: int) -> VirtualEncoder:
    """The same encoder with other random numbers."""
    return replace(encoder, seed=seed)


def run(
    simulation: LoopSimulation, motor: Motor, encoder: VirtualEncoder, gains: Gains, task: Task, log: float, seed: int
) -> dict[str, FloatArray]:
    """A run with a seed."""
    return simulation.run(motor, edges_of(seeded(encoder, seed)), gains, task.course(seed), log=log)
