"""A core runs in a control loop: motor, encoder and controller are in the compiled engine, a whole run in one call."""

import ctypes
import math
from dataclasses import dataclass, fields
from enum import IntEnum
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.engines.compiled import Design, struct
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.spec import TachometerSpec
from tachometry.spec.control.units import longest_interval
from tachometry.spec.language.option import ParameterError

PARTS = ("plant.h", "control.h", "loop.h")
COLUMNS = ("time", "command", "speed", "angle", "held", "y", "z", "disturbance", "current", "driven", "position")
_STEP = 1e-5  # seconds
FloatArray = NDArray[np.float64]
Log = dict[str, FloatArray]


class Observer(IntEnum):
    """When and from what the disturbance is estimated: at each control tick with the held velocity (Fig. 2), with each
    update of the velocity (Fig. 11), or at each control tick from an acceleration that the core measures.
    """

    CONVENTIONAL = 0
    SYNCHRONISED = 1
    ACCELERATION = 2


@dataclass(frozen=True, kw_only=True)
class Motor:
    """Describes a motor with its driver and load; ParameterError if a parameter is out of range."""

    inertia: float = 0.003  # kg m²
    torque_constant: float = 0.0603  # Nm/A
    driver_seconds: float = 1e-4  # time constant of the current
    viscous: float = 0.0  # Nm/(rad/s)
    coulomb: float = 0.0  # Nm

    def __post_init__(self) -> None:
        _more_than_0(self, "inertia", "torque_constant")
        _at_least_0(self, "driver_seconds", "viscous", "coulomb")


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Describes a controller of velocity and position with an observer; ParameterError if a gain is out of range."""

    # position and velocity: 1/s², 1/s: k_p and k_v
    position: float
    velocity: float
    # observer and filter: rad/s: G_dis, and G_v; with an infinite G_v there is no low-pass filter of the velocity
    observer: float
    filter: float
    seconds: float  # distance of control ticks
    way: Observer = Observer.SYNCHRONISED
    delay: float = 0.0  # s: from a control tick until its current is commanded, at most `seconds`
    on_filtered: bool = True  # whether k_v acts on the velocity behind the filter, not before it
    feed_forward: bool = False  # whether the acceleration of the command is added
    # inertia and torque_constant: kg m², Nm/A: as the controller knows them
    inertia: float = 0.003
    torque_constant: float = 0.0603
    current_limit: float = 8.0  # A

    def __post_init__(self) -> None:
        _more_than_0(self, "observer", "seconds", "inertia", "torque_constant", "current_limit")
        if not self.filter > 0:
            raise ParameterError("velocity_filter", f"must be more than 0, not {self.filter:g}")
        _at_least_0(self, "position", "velocity", "delay")
        if self.delay > self.seconds:
            raise ParameterError("delay", f"must be at most a control tick, {self.seconds:g} s, not {self.delay:g}")


# What the parameters are called where they are given.
_CALLED = {"position": "kp", "velocity": "kv", "coulomb": "friction", "driver_seconds": "driver_time"}


def _more_than_0(what: object, *names: str) -> None:
    for name in names:
        if not 0 < getattr(what, name) < math.inf:
            raise ParameterError(_CALLED.get(name, name), f"must be more than 0, not {getattr(what, name):g}")


def _at_least_0(what: object, *names: str) -> None:
    for name in names:
        if not 0 <= getattr(what, name) < math.inf:
            raise ParameterError(_CALLED.get(name, name), f"must be at least 0, not {getattr(what, name):g}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Course:
    """Holds the commands, and what comes in between; all at times `seconds` apart."""

    seconds: float
    # speed and angle: shape (n,), rad/s and rad: commanded; between two times the speed is a line
    speed: FloatArray
    angle: FloatArray
    load: FloatArray  # shape (n,), Nm: against the shaft, from each time to the next
    # shape (n,), A: added to the command behind the controller, which does not know of it: a virtual disturbance
    current: FloatArray


@dataclass(frozen=True, eq=False)
class Edges:
    """Says where a disc's edges are met."""

    offset: FloatArray  # shape (k,): of each edge, in pitches; the k-th after the last is the first again
    # shape (n,): of each passage, in gaps to the nearer neighbour, one after the other; after the last comes the first
    # again
    jitter: FloatArray


class LoopDesign(Design):
    """Describes a core to be compiled with plant and controller."""

    def source(self, model: str) -> str:
        head = f"#define N_COLUMNS {len(self.outputs)}\n#define GATES 0\n#include <cstdint>\n"
        parts = [files(__package__).joinpath(part).read_text(encoding="utf-8") for part in PARTS]
        return "\n".join([head, model, *parts])


_D, _I, _P = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p
_MOTOR = struct("Motor", **{field.name: _D for field in fields(Motor)})
_GAINS = ("position", "velocity", "observer", "filter", "inertia", "torque_constant", "current_limit")
_WAYS = ("way", "on_filtered", "feed_forward")
_ENCODER = struct("Encoder", pitch=_D, offset=_P, n_edges=_I, jitter=_P, n_jitter=_I)
CONTROLLER = struct(
    "Controller", **dict.fromkeys(_GAINS, _D), **dict.fromkeys((*_WAYS, "clocks", "first", "delay"), _I)
)
_CORE = struct(
    "Core",
    **dict.fromkeys(("rad_per_s", "rad_per_s2", "rad_per_count"), _D),
    **dict.fromkeys(("velocity", "valid", "position", "acceleration", "forced", "longest"), _I),
    clock_seconds=_D,
)
_COURSE = struct("Course", speed=_P, angle=_P, load=_P, current=_P, n=_I, clocks=_I)
_LOOP = struct(
    "Loop",
    **{"motor": _MOTOR, "encoder": _ENCODER, "controller": CONTROLLER, "core": _CORE, "course": _COURSE},
    **dict.fromkeys(("step", "end", "log"), _I),
    rows=_P,
    n_rows=_I,
    away=_I,
    stop=_P,
    gates=_P,
)


class LoopSimulation:
    """Runs the core of a spec, or a design with it, in loops; it is compiled once. Runs may go on in several threads at
    once.

    It raises NoCompiler if there is no C++ compiler.
    """

    def __init__(self, spec: TachometerSpec, design: LoopDesign | None = None) -> None:
        self._spec = spec
        self._design = design or LoopDesign(spec, list(spec.ports.pins))
        self._library = ctypes.CDLL(str(Cxxrtl().library(self._design)))
        self._stop = _I(0)

    def stop(self, ending: bool = True) -> None:
        """End all runs at once, also those that begin later, until they may go on again."""
        self._stop.value = ending

    def run(self, motor: Motor, edges: Edges, gains: Gains, course: Course, *, log: float = 1e-4) -> Log:
        """Return a run as long as the course, from rest: a column of values at times `log` seconds apart for each name.

        The motor goes on in steps of 10 us, or from event to event. It raises ValueError if the shaft runs away.
        """
        return self.call(motor, edges, self._controller(gains), course, log, None)

    def call(self, motor: Motor, edges: Edges, controller: Any, course: Course, log: float, gates: int | None) -> Log:
        """Run as `run` does; `gates` describes a controller in gates, in place of one in double precision."""
        spec = self._spec
        arrays = (edges.offset, edges.jitter, course.speed, course.angle, course.load, course.current)
        offset, jitter, *tables = (np.ascontiguousarray(one, dtype=np.float64) for one in arrays)
        end, apart = self.clocks(course.seconds) * (len(course.speed) - 1), self.clocks(log)
        rows = np.zeros((end // apart + 1, len(COLUMNS)))
        loop = _LOOP(
            motor=_MOTOR(**{field.name: getattr(motor, field.name) for field in fields(Motor)}),
            encoder=_ENCODER(
                2 * np.pi / float(4 * spec.encoder.pulses_per_rev * spec.encoder.turns),
                offset.ctypes.data,
                len(offset),
                jitter.ctypes.data,
                len(jitter),
            ),
            controller=controller,
            core=self._core(controller.clocks),
            course=_COURSE(*(one.ctypes.data for one in tables), len(course.speed), self.clocks(course.seconds)),
            **{"step": self.clocks(_STEP), "end": end, "log": apart, "rows": rows.ctypes.data},
            away=-1,
            stop=ctypes.addressof(self._stop),
            gates=gates,
        )
        self._library.loop_run(ctypes.byref(loop))
        if loop.away >= 0:
            time = loop.away / spec.timing.clock_hz
            raise ValueError(
                f"the shaft ran away {time:.6g} s after the start, by more than two edges in a clock; "
                "gains, motor and load must be those of a drive"
            )
        return dict(zip(COLUMNS, rows[: loop.n_rows].T, strict=True))

    def clocks(self, seconds: float) -> int:
        """Return a time in whole clocks, at least one."""
        return max(round(seconds * self._spec.timing.clock_hz), 1)

    def _controller(self, gains: Gains) -> Any:
        clocks, spec = self.clocks(gains.seconds), self._spec
        # It comes when the velocity of a tick is there.
        first = (spec.latency.pin_to_count + spec.latency.tick + spec.latency.tick_to_velocity + 1) % clocks
        delay = min(round(gains.delay * spec.timing.clock_hz), clocks)
        return CONTROLLER(*(getattr(gains, name) for name in (*_GAINS, *_WAYS)), clocks, first, delay)

    def _core(self, period: int) -> Any:
        spec, names = self._spec, [port.name for port in self._design.outputs]
        acceleration = float(spec.method_entries.get("acceleration", {}).get("rad_per_s2_per_lsb", 0.0))
        columns = [names.index(name) for name in ("velocity", "velocity_valid", "position")]
        columns.append(names.index("acceleration") if acceleration else -1)
        columns.append(names.index("forced") if spec.facts.awaits_count else -1)
        columns.append(longest_interval(spec, period) * period)
        per_count = 2 * np.pi / spec.encoder.counts_per_rev
        return _CORE(spec.velocity.rad_per_s_per_lsb, acceleration, per_count, *columns, 1 / spec.timing.clock_hz)
