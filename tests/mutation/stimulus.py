"""What is played on the mutants: many short motions with a reset before each, in the middle of the one before."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.recording import PinTrace
from tachometry.sim.stress import stress
from tachometry.spec import TachometerSpec

_EDGES = 100  # of a motion, at each of its speeds
_RATES = (0.5, 0.2, 0.05)  # changes of a line in a clock


@dataclass(frozen=True)
class Stimulus:
    """Levels of the inputs, and what they were made of.

    Parameters
    ----------
    pins : uint8 array, shape (clocks,)
        Bit 0 is `rst`, above it the other inputs in the order of the ports.
    traces : list of PinTrace
        One after each reset.
    starts : list of int
        Clock in which each of them begins, the first one after a reset.
    """

    pins: NDArray[np.uint8]
    traces: list[PinTrace]
    starts: list[int]


def noise(spec: TachometerSpec, rng: np.random.Generator) -> PinTrace:
    """Lines that change at random, at rates of their own that change now and then."""
    n_clocks = 40 * spec.timing.tick_cycles * spec.timing.max_ticks
    n_parts = 20
    level = np.zeros((4, n_clocks), dtype=np.uint8)
    for line in level:
        rate = np.repeat(rng.choice((*_RATES, 0.0), n_parts), -(-n_clocks // n_parts))[:n_clocks]
        line[:] = np.cumsum(rng.random(n_clocks) < rate) % 2
    return _trace(spec, level)


def _trace(spec: TachometerSpec, level: NDArray[np.uint8]) -> PinTrace:
    """The trace with these levels of A, B, Z and the tick, as far as they are there."""
    names = [name for name, there in zip(("a", "b", "z", "tick_in"), _there(spec), strict=True) if there]
    rows = level[list(np.flatnonzero(_there(spec)))]
    clock = np.flatnonzero(np.append(True, (rows[:, 1:] != rows[:, :-1]).any(axis=0)))
    return PinTrace(clock, n_clocks=level.shape[1], **dict(zip(names, rows[:, clock], strict=True)))


def _there(spec: TachometerSpec) -> tuple[bool, ...]:
    return True, True, spec.index, spec.max_tick_cycles is not None


def stimulus(spec: TachometerSpec, n_clocks: int, seed: int = 1) -> Stimulus:
    """Motions and noise in turns, at least `n_clocks` of them."""
    rng = np.random.default_rng(seed)
    pins: list[NDArray[np.uint8]] = []
    traces: list[PinTrace] = []
    starts: list[int] = []
    done = 0
    while done < n_clocks:
        trace = stress(spec, int(rng.integers(1 << 30)), _EDGES) if len(traces) % 2 else noise(spec, rng)
        trace = trace.until(trace.n_clocks)
        if not spec.index:
            trace = PinTrace(trace.clock, trace.a, trace.b, trace.n_clocks, tick_in=trace.tick_in)
        # Some end early: the next reset comes in the middle.
        if rng.random() < 0.5:
            trace = trace.until(int(rng.integers(1, trace.n_clocks)))
        resets = int(rng.choice([1, 1, 2, 5]))
        level = np.zeros(trace.n_clocks, dtype=np.uint8)
        level[trace.clock] = 1
        row = np.cumsum(level) - 1
        played = sum((line[row] << np.uint8(bit) for bit, line in enumerate(trace.lines.values(), 1)), np.uint8(0))
        reset = rng.integers(0, 256, resets).astype(np.uint8) | np.uint8(1)
        starts.append(done + resets)
        pins += [reset, played.astype(np.uint8)]
        traces.append(trace)
        done += resets + trace.n_clocks
    return Stimulus(np.concatenate(pins), traces, starts)
