"""A velocity loop about a core: what Tsuji 2009, Sec. VII, does with a motor, and what is measured of it."""

import functools
import math
import os
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any, Protocol

import numpy as np

from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.gate_loop import GateLoop, Through
from tachometry.sim.engines.loop import Course, Edges, Gains, Log, LoopSimulation, Motor, Observer
from tachometry.spec import TachometerSpec
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.option import ParameterError

Simulation = LoopSimulation | GateLoop

LOG_SECONDS = 1e-4
_PERIOD = 1e-3  # s, of the tables of a course
_PASSAGES = 1 << 16
_SOUND_HZ = 50.0
_AT_LIMIT = 0.999


class Command(Protocol):
    """A commanded speed: any `Motion` is one."""

    @property
    def duration(self) -> float: ...
    def speed(self, t: FloatArray) -> FloatArray: ...


@dataclass(frozen=True, kw_only=True)
class Load:
    """Describes a torque that acts for some time."""

    torque: float  # Nm: against the shaft
    # begin and seconds: s
    begin: float
    seconds: float

    def __post_init__(self) -> None:
        if not (self.begin >= 0 and self.seconds > 0 and math.isfinite(self.torque)):
            raise ParameterError("load", "must begin at 0 s or later and last longer than 0 s")


@dataclass(frozen=True, kw_only=True)
class Task:
    """Describes how the shaft is to move, and what disturbs it."""

    motion: Command  # the commanded speed, and by its integral the commanded angle
    load: Load | None = None
    # the load is a current that is added behind the controller, as in the paper's experiment, and no torque
    virtual: bool = False
    noise: float = 0.0  # Nm rms: of the torque: Gaussian, a new value every millisecond

    def course(self, motor: Motor, seed: int) -> Course:
        """Return the tables of a run."""
        time = np.arange(max(math.ceil(self.motion.duration / _PERIOD - 1e-9), 1) + 1) * _PERIOD
        time = np.minimum(time, self.motion.duration)
        load = self.noise * np.random.default_rng([seed, 1]).standard_normal(len(time))
        current = np.zeros(len(time))
        if self.load is not None:
            torque = self.load.torque * ((time >= self.load.begin) & (time < self.load.begin + self.load.seconds))
            if self.virtual:
                current -= torque / motor.torque_constant
            else:
                load += torque
        speed = self.motion.speed(time)
        # The integral of what is drawn between two values, so that speed and angle agree.
        angle = np.append(0.0, np.cumsum((speed[1:] + speed[:-1]) / 2 * _PERIOD))
        return Course(seconds=_PERIOD, speed=speed, angle=angle, load=load, current=current)


def edges_of(encoder: VirtualEncoder) -> Edges:
    """Return the disc of a virtual encoder, and its jitter as a displacement of each passage."""
    jitter = encoder.jitter * np.random.default_rng([encoder.seed, 2]).standard_normal(_PASSAGES)
    return Edges(np.asarray(encoder.disc.offset), jitter)


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Figures of a run: all but the dip from a time on until a load comes."""

    # rms and largest, rad/s: of the shaft's true speed less the commanded one
    rms: float
    largest: float
    sound: float  # A rms: of the commanded current, above 50 Hz: what is heard
    limited: float  # share of the time in which the commanded current is at its limit
    # rad/s: the largest deviation of the true speed while a load is there and for as long behind it, less the mean for
    # as long before it; None without a load
    dip: float | None


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A loop: a core, what is about it, and what it is to do."""

    spec: TachometerSpec
    gains: Gains
    task: Task
    motor: Motor = field(default_factory=Motor)
    encoder: VirtualEncoder
    begin: float = 0.0  # s: from when on it is judged
    gates: LoopSpec | None = None  # the core whose controller runs in place of one in double precision, see `in_gates`

    @property
    def simulation(self) -> Simulation:
        """The compiled simulation of its core."""
        return simulation_of(self.gates or self.spec)

    def run(self, simulation: Simulation, seed: int, log: float = LOG_SECONDS) -> Log:
        """Return the log of a run with a seed, which every random number depends on."""
        if isinstance(simulation, GateLoop):
            return self.through(simulation, seed, log)[0]
        edges = edges_of(replace(self.encoder, seed=seed))
        return simulation.run(self.motor, edges, self.gains, self.task.course(self.motor, seed), log=log)

    def through(self, simulation: GateLoop, seed: int, log: float = LOG_SECONDS) -> tuple[Log, Through]:
        """Return the same of a controller in gates, and what went through it."""
        edges, course = edges_of(replace(self.encoder, seed=seed)), self.task.course(self.motor, seed)
        return simulation.run(self.motor, edges, course, feed_forward=self.gains.feed_forward, log=log)

    def outcome(self, log: Log) -> Outcome:
        """Return what came of a run."""
        until = self.task.motion.duration if self.task.load is None else self.task.load.begin
        late = (log["time"] >= self.begin) & (log["time"] < until)
        error = (log["speed"] - log["command"])[late]
        current = log["current"][late]
        return Outcome(
            rms=float(np.sqrt(np.mean(error**2))),
            largest=float(np.abs(error).max()),
            sound=sound(current, float(log["time"][1] - log["time"][0])),
            limited=float(np.mean(np.abs(current) >= _AT_LIMIT * self.gains.current_limit)),
            dip=None if self.task.load is None else _dip(log, self.task.load),
        )


def sound(current: FloatArray, seconds: float) -> float:
    """Return the RMS of a current, sampled every so many seconds, above 50 Hz."""
    spectrum = np.abs(np.fft.rfft(current - current.mean()))
    loud = np.fft.rfftfreq(len(current), seconds) > _SOUND_HZ
    return float(np.sqrt(2 * np.sum(spectrum[loud] ** 2)) / len(current))


def _dip(log: Log, load: Load) -> float:
    time, error = log["time"], log["speed"] - log["command"]
    before = error[(time >= load.begin - load.seconds) & (time < load.begin)]
    during = error[(time >= load.begin) & (time < load.begin + 2 * load.seconds)]
    return float(np.abs(during - (before.mean() if len(before) else 0.0)).max())


def mean(outcomes: Sequence[Outcome]) -> Outcome:
    """Return the mean of outcomes, but the largest deviation of all."""
    dips = [one.dip for one in outcomes if one.dip is not None]
    return Outcome(
        rms=float(np.mean([one.rms for one in outcomes])),
        largest=max(one.largest for one in outcomes),
        sound=float(np.mean([one.sound for one in outcomes])),
        limited=float(np.mean([one.limited for one in outcomes])),
        dip=float(np.mean(dips)) if dips else None,
    )


@functools.lru_cache(maxsize=32)
def simulation_of(spec: TachometerSpec | LoopSpec) -> Any:
    """Return the compiled simulation of a core: a `GateLoop` if it has its loop in gates, else a `LoopSimulation`."""
    return GateLoop(spec) if spec.kind == "loop" else LoopSimulation(spec)


def in_gates(setting: Setting) -> Setting:
    """Return the same loop with its controller in gates; products are formed bit by bit where that is fast enough.

    It raises ParameterError if it is none that there is in gates.
    """
    gains = setting.gains
    for name, wrong in (
        ("delay", gains.delay > 0),
        ("unfiltered", not gains.on_filtered),
        ("measured_acceleration", gains.way is Observer.ACCELERATION),
    ):
        if wrong:
            raise ParameterError(name, "must not be given together with --gates")

    def exact(value: float) -> Fraction:
        return Fraction(f"{value:.12g}")

    given: dict[str, Any] = {
        "tachometer": setting.spec,
        "inertia": exact(gains.inertia),
        "torque_constant": exact(gains.torque_constant),
        "position_gain": exact(gains.position),
        "velocity_gain": exact(gains.velocity),
        "observer": exact(gains.observer),
        "velocity_filter": Fraction(0) if math.isinf(gains.filter) else exact(gains.filter),
        "current_limit": exact(gains.current_limit),
        "control_period": round(gains.seconds * setting.spec.timing.clock_hz),
        "synchronised": gains.way is Observer.SYNCHRONISED,
    }
    try:
        gates = LoopSpec(**given)
    except ParameterError as error:
        if error.parameter != "control_period":
            raise
        gates = LoopSpec(**given, multiplier="parallel")
    return replace(setting, gates=gates)


def each_seed(setting: Setting, seeds: Sequence[int], jobs: int | None = None) -> Iterator[Log]:
    """Yield logs of a setting in the order of the seeds, run in so many threads, by default one for each core."""
    simulation = setting.simulation
    with ThreadPoolExecutor(jobs or os.cpu_count()) as pool:
        try:
            yield from pool.map(lambda seed: setting.run(simulation, seed), seeds)
        except BaseException:
            simulation.stop()  # the runs in all threads, for which this one then waits
            pool.shutdown(cancel_futures=True)
            simulation.stop(False)
            raise


def outcome_of(setting: Setting, seeds: Sequence[int], jobs: int | None = None) -> Outcome:
    """Return the mean outcome of a setting."""
    return mean([setting.outcome(log) for log in each_seed(setting, seeds, jobs)])
