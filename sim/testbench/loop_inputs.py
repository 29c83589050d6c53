"""A testbench puts commands, demands and gains of all sizes on the inputs of a control loop."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.golden.command_generator import Command, Demand, Gains
from tachometry.sim.golden.control import run_loop
from tachometry.sim.golden.front_end import count, decoded
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.form import POSITION_FRAC_BITS
from tachometry.spec.control.ports import GAIN_PORTS
from tachometry.spec.language.port import Port

_COMMANDS = ("command_position", "command_velocity", "command_acceleration")
_DEMANDS = tuple(f"generator_{name}" for name in ("mode", "velocity", "acceleration", "amplitude", "rate"))
_CHANGES = 0.1  # of control ticks in which an input changes, and as often it is the greatest
IntArray = NDArray[np.int64]


def loop_inputs(spec: LoopSpec, trace: PinTrace) -> tuple[dict[str, IntArray], Run]:
    """Return the levels of all inputs of the loop by control tick, without a sign, and what the core must show."""
    clock = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
    inputs = _inputs(spec, trace, clock)
    widths = {port.name: port.width for port in spec.ports.pins}
    bits = {name: values & ((1 << widths[name]) - 1) for name, values in inputs.items()}
    columns = {name: values.tolist() for name, values in (inputs | _held(inputs)).items()}

    def rows(*names: str) -> Any:
        return zip(*(columns[name] for name in names), strict=True)

    commands: list[Command] | list[Demand]
    if spec.command == "generator":
        commands = [Demand(*row) for row in rows(*_DEMANDS, "enable")]
    else:
        commands = [Command(*row) for row in rows(*_COMMANDS, "enable")]
    gains = [Gains(*row) for row in rows(*GAIN_PORTS.values(), "current_limit")] if spec.form.gain_bits else None
    return bits, run_loop(spec, trace, commands, golden.tables, gains)


def _inputs(spec: LoopSpec, trace: PinTrace, clock: IntArray) -> dict[str, IntArray]:
    """Return the numbers on the inputs of the loop at its control ticks."""
    rng = np.random.default_rng(1)
    alone = spec.tachometer
    own = {port.name for port in alone.ports}
    inputs = {port.name: _levels(port, rng, len(clock)) for port in spec.ports.pins if port.name not in own}
    if "command_position" in inputs:
        # About the shaft, so that the current is not always at its limit.
        places, _ = count(alone, decoded(alone, trace), clock - alone.latency.tick)
        here = (places.position << POSITION_FRAC_BITS) + (inputs["command_position"] >> alone.position_width)
        inputs["command_position"] = np.where(rng.random(len(clock)) < 0.9, here, inputs["command_position"])
    if spec.form.gain_bits:
        options = {GAIN_PORTS[term]: raw for term, raw in spec.form.reset_gains.items()}
        for name, raw in (options | {"current_limit": spec.form.current_limit}).items():
            inputs[name] = np.where(rng.random(len(clock)) < 0.7, raw, inputs[name])
    inputs["enable"] = (rng.random(len(clock)) < 1 - _CHANGES).astype(np.int64)
    return inputs


def _levels(port: Port, rng: np.random.Generator, n: int) -> IntArray:
    """Return numbers of any size, the greatest among them, each for some control ticks."""
    bits = port.width - port.signed
    most, least = (1 << bits) - 1, -(1 << bits) if port.signed else 0
    size = np.exp2(rng.uniform(0, 1, n) ** 2 * bits).astype(np.int64)
    numbers = rng.integers(-size if port.signed else np.zeros_like(size), size + 1).clip(least, most)
    numbers = np.where(rng.random(n) < _CHANGES, rng.choice([least, most], n), numbers)
    return numbers[np.maximum.accumulate(np.where(rng.random(n) < 4 * _CHANGES, np.arange(n), 0))]


def _held(inputs: dict[str, IntArray]) -> dict[str, IntArray]:
    """Return the values that are taken where inputs are frozen now and then."""
    freeze = inputs.get("freeze")
    if freeze is None:
        return {}
    last = np.maximum.accumulate(np.where(freeze == 0, np.arange(len(freeze)), -1))
    return {
        name: np.where(last < 0, 0, values[np.maximum(last, 0)]) for name, values in inputs.items() if name != "enable"
    }


def changes(spec: LoopSpec, trace: PinTrace, inputs: dict[str, IntArray]) -> list[IntArray]:
    """Return columns of clocks, lines and inputs: these are there from two clocks before their control tick on."""
    tick = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
    at = np.unique(np.concatenate([trace.clock, tick - 2]))
    at = at[(at >= 0) & (at < trace.n_clocks)]
    line = np.maximum(np.searchsorted(trace.clock, at, side="right") - 1, 0)
    which = np.searchsorted(tick - 2, at, side="right") - 1
    lines = [levels[line].astype(np.int64) for levels in trace.lines.values()]
    return [at, *lines, *(np.where(which < 0, 0, values[np.maximum(which, 0)]) for values in inputs.values())]
