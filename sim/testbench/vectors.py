"""A testbench stands on its own: its data say what to put on the pins, and what the outputs must show."""

import json
import math
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.encoder.imperfections import Bounce
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.sampled import encoder_of
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.command_generator import Command, Demand, Gains
from tachometry.sim.golden.control import run_loop
from tachometry.sim.golden.front_end import count, decoded
from tachometry.sim.signals.arrays import Ints
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace, Recording, check_ticks
from tachometry.sim.signals.run import Run
from tachometry.spec import TachometerSpec
from tachometry.spec.control import AnySpec, LoopSpec
from tachometry.spec.control.form import POSITION_FRAC_BITS
from tachometry.spec.control.ports import GAIN_PORTS
from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.port import Port
from tachometry.spec.language.provenance import LICENSE, generator, notice

# It has no hole: it reads its name and its data where it lies, so it is a program that linters and mypy read.
_BENCH = files(__package__) / "templates" / "test_NAME.py"
# Clocks of the motion, and at most five times as many of the standstill after it: Icarus takes some 40,000 a second.
_MOVING = 160_000
_FEWEST_TICKS, _MOST_TICKS = 3, 1000

_MOST_BENCH_TICKS = 2_000_000  # of which each is a row of text
# Commands, demands and gains of a loop, of all sizes.
_COMMANDS = ("command_position", "command_velocity", "command_acceleration")
_DEMANDS = tuple(f"generator_{name}" for name in ("mode", "velocity", "acceleration", "amplitude", "rate"))
_CHANGES = 0.1  # of control ticks in which an input changes, and as often it is the greatest


def cocotb_bench(core: AnySpec, name: str, recordings: Sequence[Recording] | None = None) -> dict[str, str]:
    """Return a bench for cocotb as texts by file name: `test_NAME.py` and `NAME_vectors.json`.

    - `core`: The inputs of a loop are given numbers of all sizes.
    - `name`: Of the module; `NAME.v` and its manifest `NAME.json` must lie beside the bench.
    - `recordings`: What to put on the pins, of each axis; None: `usual_motion`.

    It raises ValueError if it does not last for a tick, or for too many.
    """
    spec = core.tachometer
    traces = []
    for recording in _usual(core) if recordings is None else recordings:
        check_ticks(recording.duration, spec, _MOST_BENCH_TICKS // (core.axes or 1))
        trace = recording.place(spec.timing.clock_hz)
        if spec.external_tick:
            trace = trace.with_tick_in(_external_ticks(spec, trace.n_clocks))
        for number, name_of in enumerate(spec.front_end.pulsed):
            rises = np.arange(1, 8) * trace.n_clocks // (9 + number)
            trace = trace.with_pulses(name_of, rises, spec.filter_clocks + 1)
        traces.append(trace.completed(spec))
    # Probes latch once, as on a bus nothing arms them.
    for place, trace in enumerate(traces):
        low = {name: np.zeros_like(trace.lines[name]) for name in _acts(core) if name in trace.lines}
        traces[place] = PinTrace.of_lines(trace.clock, trace.n_clocks, trace.lines | low)
    text = json.dumps(_vectors(core, traces), separators=(",", ":")).replace("[[", "[\n[").replace("],", "],\n") + "\n"
    return {f"test_{name}.py": notice("#") + _BENCH.read_text(encoding="utf-8"), f"{name}_vectors.json": text}


def _vectors(core: AnySpec, traces: Sequence[PinTrace]) -> dict[str, Any]:
    """Return the content of `NAME_vectors.json`; test_NAME.py says what stands where."""
    pins, (clock, *levels), run = _put(core, traces)
    driven = {pin: level for pin, level in zip(pins, levels, strict=True) if pin not in _acts(core)}
    if not len(run.ticks.clock):
        raise ParameterError("motion", f"must last for a tick, not for {run.n_clocks} clocks")
    return {
        "generator": generator(),
        "license": LICENSE,
        "clocks": run.n_clocks,
        "pins": [*driven],
        "changes": _rows(clock, *driven.values()),
        "strobes": strobe_rows(run, holds=core.axes is None),
    }


def _acts(core: AnySpec) -> set[str]:
    """Return inputs that are registers on a bus, which no bench writes."""
    spec = core.tachometer
    return {field.port for extra in spec.extras for _, _, fields, _ in extra.registers(spec) for field in fields}


def _put(core: AnySpec, traces: Sequence[PinTrace]) -> tuple[list[str], list[NDArray[Any]], Run]:
    """Return names of the inputs, the clocks of changes with their values, and what the core must show."""
    if core.axes is not None:
        pins = AxesTrace.of(traces)
        return [*pins.lines], [pins.clock, *pins.lines.values()], golden.run(core, pins)
    (trace,) = traces
    if core.kind == "loop":
        inputs, run = loop_inputs(core, trace)
        return [*trace.lines, *inputs], [*loop_changes(core, trace, inputs)], run
    lines = {name: line for name, line in trace.lines.items() if name in {pin.name for pin in core.ports.pins}}
    return [*lines], [trace.clock, *lines.values()], golden.run(core, trace)


def _usual(core: AnySpec) -> list[Recording]:
    if core.axes is None:
        return [usual_motion(core.tachometer)]
    return [usual_motion(core.axis, seed=axis + 1, most=_MOVING // core.slots) for axis in range(core.axes)]


def usual_motion(spec: TachometerSpec, seed: int = 1, most: int = _MOVING) -> Recording:
    """Return fast and slow, forward, backward and back over the index, with jitter and illegal transitions, then at
    rest.

    It makes the tours of extras before that. It moves for at most `most` clocks. The rest
    outlasts the maximum time, so that the core reads zero, if that takes at most five times as many; else it is short.
    """
    usual = _usual_form(spec, most, backward=seed % 2 == 0)
    if spec.encoder.sampled is not None:
        read = encoder_of(spec, noise=0.5, frame_errors=0.01, seed=seed)
        return read.record(parse_motion(usual)).recording
    bounces = spec.filter_clocks and spec.encoder.sensor in ("quadrature", "pulses", "hall")
    encoder = VirtualEncoder.of(
        spec.encoder,
        jitter=0.1,
        illegal=0.01 if spec.encoder.sensor == "quadrature" else 0,
        bounce=Bounce(1, float(spec.filter_clocks / spec.timing.clock_hz)) if bounces else None,
        start_angle_rad=-3.5 * np.pi / (2 * spec.encoder.pulses_per_rev),
        seed=seed,
        index=spec.index is not None,
        index_state=spec.front_end.index_place,
    )
    tours = [part for extra in spec.extras for part in _tour(spec, extra.tour(spec), 5 * most)]
    return encoder.record(parse_motion("+".join([*tours, usual]))).recording


def _fastest(spec: TachometerSpec) -> float:
    """Return counts per tick that the lines can have: an edge in two clocks, slower with a filter."""
    if spec.encoder.sampled is not None:
        return float(spec.tick.max_count) / 2
    edges = 12 if spec.encoder.sensor == "hall" else 8
    return spec.timing.tick_cycles * spec.encoder.decoding / edges / (1 + max(spec.filter_clocks, spec.blanking_clocks))


def _tour(spec: TachometerSpec, positions: Sequence[int], longest: int) -> list[str]:
    """Return segments over these positions, if that takes no more clocks."""
    if not positions:
        return []
    first, last = positions[0], positions[-1]
    most, more = _fastest(spec), 3 + abs(first) // 16  # since illegal transitions lose counts
    beyond = int(math.copysign(more, last - first))
    ways = [first - beyond, last + beyond - (first - beyond)]
    seconds = [abs(way) / most * float(spec.timing.tick_seconds) for way in ways]
    if sum(seconds) * spec.timing.clock_hz > longest:
        return []
    speed = most * spec.scale.unit_velocity
    return [
        f"constant:{math.copysign(speed, way)}rad/s:{lasts}s" for way, lasts in zip(ways, seconds, strict=True) if way
    ]


def _usual_form(spec: TachometerSpec, longest: int, *, backward: bool) -> str:
    """Return the segments of `usual_motion`."""
    cycles, clock_hz = spec.timing.tick_cycles, spec.timing.clock_hz
    moving = max(min(longest, _MOST_TICKS * cycles), _FEWEST_TICKS * cycles)
    standing = cycles * (8 * spec.timing.max_ticks // 5 + 10)
    if standing > 5 * longest:
        standing = max(longest // 8, cycles)
    most = _fastest(spec)
    part = moving / 8 / clock_hz

    def speed(counts_per_tick: float) -> str:
        return f"{spec.scale.unit_velocity * (-counts_per_tick if backward else counts_per_tick)}rad/s"

    brisk, fast = min(3.3, most), min(1.5 * spec.tick.max_count, most)
    return (
        f"ramp:0:{speed(brisk)}:{part}s+constant:{speed(min(1.25, most))}:{part}s+constant:{speed(fast)}:{part / 20}s"
        f"+constant:{speed(-fast)}:{part / 20}s+constant:{speed(-min(1.25, most))}:{part}s"
        f"+ramp:{speed(-brisk)}:0:{part}s+sine:{speed(brisk / 2)}:{3 / part}Hz:{part}s"
        f"+constant:{speed(min(0.3, most))}:{part}s+constant:{speed(-min(0.04, most))}:{2 * part}s"
        f"+stop:{standing / clock_hz}s"
    )


def _external_ticks(spec: TachometerSpec, n_clocks: int) -> NDArray[np.int64]:
    """Return clocks of ticks that come a little early or late, sometimes much too early or too late."""
    cycles = spec.timing.tick_cycles
    k = np.arange(n_clocks // 2 // cycles + 2)
    gap = cycles + (k % 5 - 2) * (cycles // 16)
    gap[7::30] = 2
    gap[17::30] = 3 * spec.tick.longest
    return np.cumsum(np.maximum(gap, 2)).astype(np.int64)


def strobe_rows(run: Run, *, holds: bool = True) -> dict[str, Any]:
    """Return each strobe of the core, with its ports and rows; with `tick` also what it holds since the last update."""
    last = np.searchsorted(run.updates.clock, run.ticks.clock, side="right")
    held = {name: np.array([None, *column], dtype=object)[last] for name, column in run.updates.columns.items()}
    strobes = {}
    for strobe, table in run.tables.items():
        columns = {**table.columns, **(held if table is run.ticks and holds else {})}
        strobes[strobe] = {"ports": list(columns), "rows": _rows(table.clock, *columns.values())}
    return strobes


def _rows(*columns: NDArray[Any]) -> list[list[int | None]]:
    return [[None if cell is None else int(cell) for cell in row] for row in zip(*columns, strict=True)]


def loop_inputs(spec: LoopSpec, trace: PinTrace) -> tuple[dict[str, Ints], Run]:
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


def _inputs(spec: LoopSpec, trace: PinTrace, clock: Ints) -> dict[str, Ints]:
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


def _levels(port: Port, rng: np.random.Generator, n: int) -> Ints:
    """Return numbers of any size, the greatest among them, each for some control ticks."""
    bits = port.width - port.signed
    most, least = (1 << bits) - 1, -(1 << bits) if port.signed else 0
    size = np.exp2(rng.uniform(0, 1, n) ** 2 * bits).astype(np.int64)
    numbers = rng.integers(-size if port.signed else np.zeros_like(size), size + 1).clip(least, most)
    numbers = np.where(rng.random(n) < _CHANGES, rng.choice([least, most], n), numbers)
    return numbers[np.maximum.accumulate(np.where(rng.random(n) < 4 * _CHANGES, np.arange(n), 0))]


def _held(inputs: dict[str, Ints]) -> dict[str, Ints]:
    """Return the values that are taken where inputs are frozen now and then."""
    freeze = inputs.get("freeze")
    if freeze is None:
        return {}
    last = np.maximum.accumulate(np.where(freeze == 0, np.arange(len(freeze)), -1))
    return {
        name: np.where(last < 0, 0, values[np.maximum(last, 0)]) for name, values in inputs.items() if name != "enable"
    }


def loop_changes(spec: LoopSpec, trace: PinTrace, inputs: dict[str, Ints]) -> list[Ints]:
    """Return columns of clocks, lines and inputs: these are there from two clocks before their control tick on."""
    tick = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
    at = np.unique(np.concatenate([trace.clock, tick - 2]))
    at = at[(at >= 0) & (at < trace.n_clocks)]
    line = np.maximum(np.searchsorted(trace.clock, at, side="right") - 1, 0)
    which = np.searchsorted(tick - 2, at, side="right") - 1
    lines = [levels[line].astype(np.int64) for levels in trace.lines.values()]
    return [at, *lines, *(np.where(which < 0, 0, values[np.maximum(which, 0)]) for values in inputs.values())]
