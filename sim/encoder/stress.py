"""A motion that visits what every core must survive."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.encoder.imperfections import pulsed
from tachometry.sim.encoder.sampled import stress_reads
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.signals.axes import AxesTrace, Trace
from tachometry.sim.signals.recording import PinTrace, merged, quadrature
from tachometry.spec import CoreSpec, TachometerSpec
from tachometry.spec.core.sensors import packed_levels

_SPEEDS = (0.3, 1.01, 1.5, 2.2, 3.25, 0.1)  # counts per tick


def stress(spec: TachometerSpec, seed: int, n_edges: int = 300) -> PinTrace:
    """Return speeds about the unit velocity and its multiples, reversals, illegal transitions, creeping, standstill.

    There are `n_edges` at each of six speeds.
    """
    rng, sensor = np.random.default_rng(seed), spec.encoder.kind
    if spec.encoder.sampled is not None:
        trace = stress_reads(spec, seed, n_edges)
        return _controlled(spec, trace.completed(spec) if spec.reads else _ticked(spec, trace, rng), rng)
    cycles, longest = spec.timing.tick_cycles, spec.timing.tick_cycles * spec.timing.max_ticks
    gaps, turns = [], []
    steps = not sensor.cycle  # each is a pulse
    per_period = spec.encoder.decoding if steps else 6 if sensor.name == "hall" else 4  # edges
    least = (1.0 + steps) * (1 + spec.filter_clocks)
    for speed in _SPEEDS:
        gap = max(least, cycles * spec.encoder.decoding / per_period / speed)
        jitter = rng.choice([0, 0.2])
        sign = rng.choice([1, -1])
        gaps.append(gap * (1 + jitter * rng.standard_normal(n_edges)))
        turns.append(np.where(rng.random(n_edges) < 0.01, 2, sign))
    # Longer than a measurement: forced updates, the count after them, a standstill.
    edges = per_period // spec.encoder.decoding
    gaps.append(np.full(3 * edges, 0.7 * longest / edges))
    gaps.append(np.full(edges, 1.3 * longest / edges))
    turns.append(np.full(4 * edges, rng.choice([1, -1])))
    clock = np.append(0, np.cumsum(np.maximum(1 + steps, np.rint(np.concatenate(gaps))).astype(np.int64)))
    turn = np.concatenate(turns)
    edge, counts = clock[1:], np.cumsum(turn) * spec.encoder.decoding / per_period
    clock, level = _levels(spec, clock, turn, rng)
    z = (rng.random(len(clock)) < 0.05).astype(np.uint8)
    if spec.front_end.index_state is not None:  # at times wider than a period
        z |= np.repeat(rng.random(len(clock) // 12 + 1) < 0.1, 12)[: len(clock)].astype(np.uint8)
    n_clocks = int(clock[-1]) + spec.facts.rest_tenths * longest // 10 + 40 * cycles + 300
    a, b, c = (level >> np.uint8(line) & np.uint8(1) for line in range(3))
    trace = PinTrace(clock, a, b, n_clocks, z, c=c if "c" in sensor.lines else None)
    trace = _probed(spec, trace, np.interp(clock, edge, counts).astype(np.int64), seed)
    return _ticked(spec, _controlled(spec, _open(spec, trace, seed), rng), rng)


def _controlled(spec: TachometerSpec, trace: PinTrace, rng: np.random.Generator) -> PinTrace:
    """Return the trace with rises of the inputs that move the position or arm the index."""
    n_clocks = trace.n_clocks
    for name in spec.front_end.controls:
        few = 30 if name == "preset" else 6
        high = spec.filter_clocks + int(rng.integers(1, 30))
        apart = rng.integers(high + spec.filter_clocks + 1, n_clocks // few + high + spec.filter_clocks + 2, few)
        trace = trace.with_pulses(name, np.cumsum(apart), high)
    return trace


def _levels(
    spec: TachometerSpec, clock: NDArray[np.int64], turn: NDArray[np.int64], rng: np.random.Generator
) -> tuple[NDArray[np.int64], NDArray[np.uint8]]:
    """Return clocks and levels of the lines of steps at these clocks, some of which are illegal."""
    sensor = spec.encoder.kind
    if not sensor.cycle:
        form = {"directed": sensor.name == "step-dir", "both_edges": spec.encoder.decoding == 2}
        at, level = pulsed(clock.astype(np.float64), turn, float(clock[-1] + 2), **form)
        level[rng.random(len(level)) < 0.05] = 3  # both lines rise
        return at.astype(np.int64), level
    place = np.append(0, np.cumsum(turn))
    levels = np.array([packed_levels(each) for each in sensor.cycle], dtype=np.uint8)
    level = levels[place % 6] if sensor.name == "hall" else quadrature(place)
    if sensor.name == "hall":
        level[rng.random(len(level)) < 0.01] = 7
    return clock, VirtualEncoder.of(spec.encoder).patterned(level, place)


def _ticked(spec: TachometerSpec, trace: PinTrace, rng: np.random.Generator) -> PinTrace:
    """Return the trace with external ticks if there are any, some early, some late, some missing."""
    if not spec.external_tick:
        return trace
    cycles = spec.timing.tick_cycles
    apart = np.full(trace.n_clocks // cycles + 1, cycles)
    apart[500:1000] += rng.integers(-cycles // 2, cycles, len(apart[500:1000]))
    apart[700:710] *= 4
    return trace.with_tick_in(np.cumsum(np.maximum(apart, 2)))


def _probed(spec: TachometerSpec, trace: PinTrace, went: NDArray[np.int64], seed: int) -> PinTrace:
    """Return the trace with edges of the inputs of extras in clocks of counts, beside them and anywhere; of an input
    that is a position, with positions near where the shaft is.
    """
    pins = [pin for pin in spec.front_end.pins if not pin.of]
    if not pins:
        return trace
    rng = np.random.default_rng([seed, 2])
    near = rng.choice(trace.clock, len(trace.clock) // 2) + rng.integers(-2, 3, len(trace.clock) // 2)
    clock = merged(trace.clock, np.clip(near, 0, trace.n_clocks - 1), rng.integers(0, trace.n_clocks, 100))
    lines: dict[str, NDArray[Any]] = {**trace.at(clock)}
    place = went[np.searchsorted(trace.clock, clock, side="right") - 1]
    for pin in pins:
        often = (0.05 if pin.port.name.endswith("clear") else 0.2) if pin.act else 0.4
        acts = rng.random(len(clock)) < often
        row = np.maximum.accumulate(np.where(acts, np.arange(len(clock)), 0))
        value: NDArray[Any]
        if pin.port.signed:
            value = place + rng.integers(-3, 4, len(clock)) & (1 << pin.port.width) - 1
        elif pin.act and not pin.rest:
            value = acts.astype(np.uint8)
        else:
            value = rng.integers(0, 1 << pin.port.width, len(clock)).astype(np.uint8)[row]
        lines[pin.port.name] = value
    return PinTrace.of_lines(clock, trace.n_clocks, lines)


def _open(spec: TachometerSpec, trace: PinTrace, seed: int) -> PinTrace:
    """Return the trace with complements that equal their lines for a while."""
    rng = np.random.default_rng([seed, 3])
    for line, most in ((pin.of, pin.holds) for pin in spec.front_end.pins if pin.of):
        begin = np.append(0, rng.integers(0, trace.n_clocks, 20))
        end = np.minimum(begin + np.append(most, rng.choice([1, most, most + 1, 3 * most], 20)), trace.n_clocks - 1)
        clock = merged(trace.clock, begin, end)
        lines = trace.at(clock)
        ended = np.searchsorted(np.sort(end), clock, side="right")
        equal = np.searchsorted(np.sort(begin), clock, side="right") > ended
        lines[f"{line}_n"] = lines[line] ^ (~equal).astype(np.uint8)
        trace = PinTrace.of_lines(clock, trace.n_clocks, lines)
    return trace


def stress_of(spec: CoreSpec, seed: int, n_edges: int = 300) -> Trace:
    """Return the same for many axes as well, each of which has a motion of its own."""
    axes = spec.axes or 1
    # Of different lengths, so that not all axes stand when one does.
    each = [stress(spec.tachometer, seed * axes + axis, n_edges + 7 * axis) for axis in range(axes)]
    return each[0] if spec.axes is None else AxesTrace.of(each)
