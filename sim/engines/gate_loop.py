"""A core that has its control loop in gates runs about a motor: pins A and B in, current out."""

import ctypes
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.engines.compiled import struct
from tachometry.sim.engines.loop import CONTROLLER, Course, Edges, Log, LoopDesign, LoopSimulation, Motor
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec.control import LoopSpec

_D, _I, _P = ctypes.c_double, ctypes.c_int64, ctypes.c_void_p
_GATES = struct(
    "Gates",
    **dict.fromkeys(("amperes", "y", "torque", "position", "velocity", "acceleration"), _D),
    **dict.fromkeys(("feed_forward", "most_velocity", "most_acceleration"), _I),
    position_mask=ctypes.c_uint64,
    **dict.fromkeys(("valid", "current", "filtered", "lead"), _I),
    **dict.fromkeys(("commands", "currents", "edges"), _P),
    **dict.fromkeys(("n_commands", "n_currents", "n_edges", "most_edges"), _I),
)
_PINS = ("a", "b", "enable", "command_position", "command_velocity", "command_acceleration")
_OUTPUTS = ("current_valid", "current", "filtered_velocity", "disturbance")
MOST_EDGES = 1 << 22


class _GateDesign(LoopDesign):
    def source(self, model: str) -> str:
        places = {pin.name: place for place, pin in enumerate(self.pins)}
        names = ("PIN_A", "PIN_B", "PIN_ENABLE", "PIN_POSITION", "PIN_VELOCITY", "PIN_ACCELERATION")
        head = "".join(f"#define {name} {places[pin]}\n" for name, pin in zip(names, _PINS, strict=True))
        text = super().source(model).replace("#define GATES 0\n", "#define GATES 1\n")
        return f"#define N_PINS {len(places)}\n{head}{text}"


@dataclass(frozen=True, eq=False)
class Through:
    """Holds all that went through a core with a loop."""

    trace: PinTrace  # the lines of the encoder
    # shape (n, 3): position, velocity and acceleration in each control tick, in LSB of the ports; the position does
    # not wrap
    commands: NDArray[np.int64]
    # shape (m, 4): with each `current_valid`: the clock, current, filtered velocity and disturbance
    currents: NDArray[np.int64]


def _traced(lines: NDArray[np.int64], n_clocks: int) -> PinTrace:
    """Return a trace of rows of a clock and levels; the last of a clock is what is seen."""
    lines = lines[np.append(lines[1:, 0] != lines[:-1, 0], True)]
    level = lines[:, 1].astype(np.uint8)
    return PinTrace(lines[:, 0], level & np.uint8(1), level >> np.uint8(1), n_clocks)


class GateLoop:
    """Runs a core with a control loop in gates about a motor; it is compiled once.

    It raises NoCompiler if there is no C++ compiler.
    """

    def __init__(self, spec: LoopSpec) -> None:
        self._spec = spec
        self._design = _GateDesign(spec, list(spec.ports.pins))
        self._simulation = LoopSimulation(spec.tachometer, self._design)

    def stop(self, ending: bool = True) -> None:
        """Stop the run, as `LoopSimulation.stop` says."""
        self._simulation.stop(ending)

    def run(
        self, motor: Motor, edges: Edges, course: Course, *, feed_forward: bool = False, log: float = 1e-4
    ) -> tuple[Log, Through]:
        """Return a run as long as the course, from rest: the columns of a log as of `LoopSimulation.run`, and what went
        through.

        It raises ValueError if there were more edges than can be held.
        """
        spec, form = self._spec, self._spec.form
        names = [port.name for port in self._design.outputs]
        widths = {pin.name: pin.width for pin in self._design.pins}
        n_clocks = self._simulation.clocks(course.seconds) * (len(course.speed) - 1)
        n_ticks = n_clocks // spec.period + 2
        commands, currents = np.zeros((n_ticks, 3), np.int64), np.zeros((n_ticks, 4), np.int64)
        lines = np.zeros((MOST_EDGES, 2), np.int64)
        per_count = 2 * math.pi / spec.tachometer.encoder.counts_per_rev
        rad_per_s, y = float(spec.units.rad_per_s), float(spec.units.rad_per_s / (1 << form.extra_bits))
        gates = _GATES(
            float(spec.units.amperes),
            y,
            float(spec.inertia * spec.observer) * y,
            per_count / 256,
            rad_per_s / (1 << form.command_bits),
            2.0**-spec.units.acceleration_frac_bits,
            feed_forward,
            *((1 << (widths[name] - 1)) - 1 for name in ("command_velocity", "command_acceleration")),
            (1 << widths["command_position"]) - 1,
            *(names.index(name) for name in _OUTPUTS),
            *(array.ctypes.data for array in (commands, currents, lines)),
            most_edges=MOST_EDGES,
        )
        # A current is at the motor in the clock after the one in which it is new.
        first, delay = spec.latency.first_tick, spec.latency.tick_to_result + 1
        controller = CONTROLLER(clocks=int(spec.period), first=first, delay=delay)
        there = ctypes.cast(ctypes.byref(gates), ctypes.c_void_p).value
        found = self._simulation.call(motor, edges, controller, course, log, there)
        if gates.n_edges >= MOST_EDGES:
            raise ValueError(f"a run must have less than {MOST_EDGES} edges")
        trace = _traced(lines[: gates.n_edges], n_clocks)
        return found, Through(trace, commands[: gates.n_commands], currents[: gates.n_currents])
