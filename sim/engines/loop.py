"""A core in a control loop: motor, encoder and controller run in the compiled engine, a whole run in one call."""

import ctypes
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.engines.compiled import Design
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.spec import TachometerSpec

_DRIVER = Path(__file__).with_name("loop.h").read_text(encoding="utf-8")
COLUMNS = ("time", "command", "speed", "angle", "held", "y", "z", "disturbance", "current", "driven", "position")
FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class Motor:
    """A motor with its driver and load.

    Parameters
    ----------
    inertia : float, kg m²
    torque_constant : float, Nm/A
    driver_seconds : float
        Time constant of the current.
    current_limit : float, A
    viscous : float, Nm/(rad/s)
    coulomb : float, Nm
    """

    inertia: float = 0.003
    torque_constant: float = 0.0603
    driver_seconds: float = 1e-4
    current_limit: float = 20.0
    viscous: float = 0.0
    coulomb: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Gains:
    """A controller of velocity and position with a disturbance observer.

    Parameters
    ----------
    position, velocity : float, 1/s², 1/s
        k_p and k_v.
    observer, filter : float, rad/s
        G_dis and G_v.
    seconds : float
        Distance of control ticks.
    synchronised : bool
        Filter and observer run with the updates of the velocity (Fig. 11), not with the control ticks (Fig. 2).
    feed_forward : bool
        Whether the acceleration of the command is added.
    """

    position: float
    velocity: float
    observer: float
    filter: float
    seconds: float
    synchronised: bool
    feed_forward: bool = False
    inertia: float = 0.003
    torque_constant: float = 0.0603
    current_limit: float = 20.0


@dataclass(frozen=True, kw_only=True)
class Course:
    """What is to be done, and what comes in between; all at times `seconds` apart.

    Parameters
    ----------
    seconds : float
    speed, angle : float64 array, shape (n,), rad/s and rad
    load : float64 array, shape (n,), Nm
    """

    seconds: float
    speed: FloatArray
    angle: FloatArray
    load: FloatArray


class _LoopDesign(Design):
    def source(self, model: str) -> str:
        head = f"#define N_COLUMNS {len(self.outputs)}\n#include <cstdint>\n"
        return f"{head}{model}\n{_DRIVER}"


def _struct(name: str, **members: Any) -> type[ctypes.Structure]:
    return type(name, (ctypes.Structure,), {"_fields_": list(members.items())})


_D, _I, _P = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p
_MOTOR = _struct("Motor", **{field.name: _D for field in fields(Motor)})
_ENCODER = _struct("Encoder", pitch=_D, offset=_P, n_edges=_I, jitter=_P, n_jitter=_I)
_CONTROLLER = _struct(
    "Controller",
    **dict.fromkeys(("position", "velocity", "observer", "filter", "inertia", "torque_constant", "current_limit"), _D),
    **dict.fromkeys(("clocks", "synchronised", "feed_forward"), _I),
)
_CORE = _struct(
    "Core",
    **dict.fromkeys(("rad_per_s", "rad_per_count", "interval_seconds"), _D),
    **dict.fromkeys(("velocity", "valid", "interval", "position"), _I),
    clock_seconds=_D,
)
_TABLES = _struct("Tables", speed=_P, angle=_P, load=_P, n=_I, clocks=_I)
_LOOP = _struct(
    "Loop",
    **{"motor": _MOTOR, "encoder": _ENCODER, "controller": _CONTROLLER, "core": _CORE, "tables": _TABLES},
    **dict.fromkeys(("step", "end", "log"), _I),
    rows=_P,
    n_rows=_I,
)


@dataclass(frozen=True, eq=False)
class Edges:
    """Where a disc's edges are met.

    Parameters
    ----------
    offset : float64 array, shape (k,)
        Of each edge, in pitches; the k-th after the last is the first again.
    jitter : float64 array, shape (n,)
        Of each passage, in pitches, one after the other; after the last comes the first again.
    """

    offset: FloatArray
    jitter: FloatArray


class LoopSimulation:
    """A core of a spec in loops; it is compiled once."""

    def __init__(self, spec: TachometerSpec) -> None:
        self._spec = spec
        self._design = _LoopDesign(spec, list(spec.pins))
        self._library = ctypes.CDLL(str(Cxxrtl().library(self._design)))

    def run(
        self, motor: Motor, edges: Edges, gains: Gains, course: Course, *, log: float, step: float = 1e-6
    ) -> dict[str, FloatArray]:
        """A run as long as the course, from rest: a column of values at times `log` seconds apart for each name."""
        spec, hz = self._spec, self._spec.timing.clock_hz

        def clocks(seconds: float) -> int:
            return max(round(seconds * hz), 1)

        names = [port.name for port in self._design.outputs]
        counts = spec.encoder.counts_per_rev
        per_count = 2 * np.pi / counts
        control = clocks(gains.seconds)
        step_clocks = min(clocks(step), control)
        while control % step_clocks:
            step_clocks -= 1
        end = clocks(course.seconds) * (len(course.speed) - 1)
        log_clocks = max(clocks(log) // step_clocks, 1) * step_clocks
        offset, jitter, speed, angle, load = (
            np.ascontiguousarray(one, dtype=np.float64)
            for one in (edges.offset, edges.jitter, course.speed, course.angle, course.load)
        )
        rows = np.zeros((end // log_clocks + 2, len(COLUMNS)))
        loop = _LOOP(
            motor=_MOTOR(**{field.name: getattr(motor, field.name) for field in fields(Motor)}),
            encoder=_ENCODER(
                2 * np.pi / (4 * spec.encoder.pulses_per_rev),
                *(offset.ctypes.data, len(offset), jitter.ctypes.data, len(jitter)),
            ),
            controller=_CONTROLLER(
                *(gains.position, gains.velocity, gains.observer, gains.filter),
                *(gains.inertia, gains.torque_constant, gains.current_limit),
                *(control, gains.synchronised, gains.feed_forward),
            ),
            core=_CORE(
                *(spec.rad_per_s_per_lsb, per_count, 0.0),
                *(names.index(name) for name in ("velocity", "velocity_valid", "interval", "position")),
                1 / hz,
            ),
            tables=_TABLES(
                *(one.ctypes.data for one in (speed, angle, load)), len(course.speed), clocks(course.seconds)
            ),
            **{"step": step_clocks, "end": end, "log": log_clocks, "rows": rows.ctypes.data},
        )
        self._library.loop_run(ctypes.byref(loop))
        return dict(zip(COLUMNS, rows[: loop.n_rows].T, strict=True))
