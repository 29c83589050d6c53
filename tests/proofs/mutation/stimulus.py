"""Many short motions are played on the mutants, with a reset before each, in the middle of the one before.

The first begins as the core powers up, without a reset.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from support.tracking import motions

from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.signals.recording import PinTrace, packed, quadrature
from tachometry.spec import STachometer, TachometerSpec, TrackTachometer
from tachometry.spec.formats.reciprocal import Reciprocal

_LINES = ("a", "b", "z", "tick_in")  # of the cores that are mutated
_EDGES = 60  # of a motion, at each of its speeds
_LONG = 100  # clocks of a tick with which motions have fewer edges, and lines change a few times in a tick
_RATTLE = 40_000  # clocks
_STEPS = 1000  # of the counts in a tick
_HARD = 16  # quotients of each m_s
_TICKS = 300  # of a motion of the tracking method; a settled one has many more counts
_SETTLED = 1500
_STOPPING = 50  # further counts, with stops between some
_RATES = (0.5, 0.2, 0.05)  # changes of a line in a clock


class Part(Protocol):
    """Holds the motion from one reset to the next."""

    @property
    def n_clocks(self) -> int:
        """Number of clocks."""


@dataclass(frozen=True)
class Stimulus:
    """Levels of the inputs, and what they were made of.

    - `pins`, uint64 array, shape (clocks, words): Bit 0 is `rst`, above it the other inputs in the order of the ports.
    - `traces`: One after each reset.
    - `starts`: Clock in which each of them begins: the first one, or the first one after a reset.
    """

    pins: NDArray[np.uint64]
    traces: Sequence[Part]
    starts: list[int]


def noise_lines(
    rng: np.random.Generator, n_clocks: int, n_lines: int, n_parts: int = 20, factor: float = 1
) -> NDArray[np.uint8]:
    """Return levels of lines that change at random, at rates of their own that change now and then."""
    rates = [factor * rate for rate in (*_RATES, 0.0)]
    rate = np.repeat(rng.choice(rates, (n_lines, n_parts)), -(-n_clocks // n_parts), axis=1)[:, :n_clocks]
    changes = np.cumsum(rng.random((n_lines, n_clocks)) < rate, axis=1)
    return ((changes + rng.integers(2, size=(n_lines, 1))) % 2).astype(np.uint8)


def noise(
    spec: TachometerSpec, rng: np.random.Generator, n_clocks: int, n_parts: int = 20, *, still: bool = False
) -> PinTrace:
    """Return such lines; those of the shaft stand still if wanted."""
    cycles = spec.timing.tick_cycles
    factor = 1 if cycles <= _LONG else float(rng.choice([1, 10 / cycles, 10 / cycles, 30 / cycles]))
    lines = noise_lines(rng, n_clocks, len(_LINES), n_parts, factor)
    if still:
        lines[:2] = lines[:2, :1]
    return _trace(spec, lines)


def bursts(spec: TachometerSpec, rng: np.random.Generator) -> PinTrace:
    """Return some edges as fast as the filter lets them, some slow, back and forth, in no order; silences; regular
    ticks.
    """
    cycles = spec.timing.tick_cycles
    parts = 40 if cycles <= _LONG else 20
    longest = cycles * spec.timing.max_ticks
    gaps = np.array([1, 1, 2, 3, cycles, 3 * cycles, longest // 2]) * max(1, (1 + spec.filter_clocks) // 2)
    edges = rng.integers(1, rng.choice([12, 100], parts, p=[0.9, 0.1]))
    apart = rng.choice(gaps, parts)
    silent = rng.random(parts) < 0.3
    edges[silent] = rng.integers(1, 4, silent.sum())
    apart[silent] = rng.integers(1, longest * 5 // 4, silent.sum())
    # Some begin with a rest, as after a reset that comes when the shaft stands.
    clock = np.cumsum(np.repeat(apart, edges)) + int(rng.choice([0, 2 * longest]))
    quarter = np.cumsum(np.repeat(rng.choice([1, 1, -1], parts), edges))
    n_clocks = int(clock[-1]) + 1
    level = _levels(clock, quarter, n_clocks)
    (z,) = noise_lines(rng, n_clocks, 1)
    tick = np.arange(n_clocks) % rng.integers(2, 2 * spec.tick.longest + 2) == 0
    return _trace(spec, np.array([level & 1, level >> 1, z, tick], dtype=np.uint8))


def steady(spec: TachometerSpec, rng: np.random.Generator) -> PinTrace:
    """Return one to two counts per tick for ever, with edges that are off by some of a count for a while, or rattle."""
    n, gap = 400, spec.timing.tick_cycles / rng.uniform(1, 2)
    off = np.repeat(rng.choice([0, 0, 0, 0.15, 0.25, 0.35], n // 20), 20) + rng.uniform(0, 0.05) * rng.standard_normal(
        n
    )
    clock = np.rint(gap * (np.arange(n) + 2 + off)).astype(np.int64)
    n_clocks = int(clock[-1]) + 1
    quarter = np.searchsorted(clock, np.arange(n_clocks), side="right") * rng.choice([-1, 1])
    for first in rng.integers(0, n_clocks - 8, 20):  # an edge there and back again
        quarter[first : first + 8 : 2] += 1
    level = quadrature(quarter)
    tick = np.arange(n_clocks) % spec.timing.tick_cycles < spec.timing.tick_cycles // 2
    return _trace(spec, np.array([level & 1, level >> 1, tick, tick], dtype=np.uint8))


def steps(spec: TachometerSpec, rng: np.random.Generator) -> PinTrace:
    """Return ticks with as many counts as the one before, for a while, and then with any others: windows of all
    lengths.
    """
    longest = spec.timing.max_ticks
    most = min(spec.timing.tick_cycles, (spec.tick.max_count + 1) * 4 // spec.encoder.decoding)
    lasts = rng.integers(1, longest + 2, _STEPS)
    counts = np.where(rng.random(_STEPS) < 0.3, rng.integers(-2, 3, _STEPS), rng.integers(-most, most + 1, _STEPS))
    return _of_counts(spec, np.repeat(np.clip(counts, -most, most), lasts))


def hard(spec: STachometer, form: Reciprocal) -> PinTrace:
    """Return windows of all lengths with the quotients nearest to a tie: only they show the last bits of a product.

    Before each window, and inside, all ticks have b counts: (d0 + d1)/(2·m_s) is of the first and the last, eq. (21).
    """
    counts = [0]
    one = 1 << form.scale_bits
    for m in range(1, form.max_m + 1):

        def near(d: int, m: int = m) -> int:
            past = ((d << spec.form.finer) * form.value(m) + form.rounding()) % one
            return min(past, one - past)

        for d in sorted(range(-4 * spec.tick.max_count, 4 * spec.tick.max_count + 1), key=near)[:_HARD]:
            b = int(np.sign(d)) * -max(0, (abs(d) - 2 * spec.tick.max_count + 1) // 2)
            first = (d + 2 * b) // 2
            counts += [b, b, first, *[b] * (m - 1), d + 2 * b - first]
    # The longest one between two empty ticks is no standstill.
    counts += [1, 1, 0, *[1] * (form.max_m - 1), 0, 1, 1]
    return _of_counts(spec, np.array(counts), spec.latency.pin_to_count)


def _of_counts(spec: TachometerSpec, counts: NDArray[np.int64], earlier: int = 0) -> PinTrace:
    """Return ticks with so many edges each, spread evenly, and some clocks earlier."""
    cycles = spec.timing.tick_cycles
    edges = [
        tick * cycles - earlier + (2 * np.arange(abs(number)) + 1) * cycles // (2 * abs(number))
        for tick, number in enumerate(counts.tolist())
        if number
    ]
    n_clocks = len(counts) * cycles
    quarter = np.cumsum(np.repeat(np.sign(counts), np.abs(counts)))
    level = _levels(np.concatenate(edges), quarter, n_clocks)
    tick = np.arange(n_clocks) % max(cycles, 2) == 0
    return _trace(spec, np.array([level & 1, level >> 1, tick, tick], dtype=np.uint8))


def rattle(spec: TachometerSpec, rng: np.random.Generator) -> PinTrace:
    """Return lines that change in nearly every clock, until the filter's count of them is at its end, and a tick that
    does.
    """
    changes = rng.random((4, _RATTLE if spec.filter_clocks else _RATTLE // 20)) < np.array([[0.9], [0.9], [0.9], [1]])
    return _trace(spec, (np.cumsum(changes, axis=1) % 2).astype(np.uint8))


def hostile(spec: TrackTachometer, rng: np.random.Generator, n_ticks: int) -> PinTrace:
    """Return motions of all kinds, as hostile as the pins allow."""
    found, last = motions(spec, rng, n_ticks)
    return _ticked(spec, rng, found.clock, np.cumsum(found.step), last)


def settled(spec: TrackTachometer, rng: np.random.Generator) -> PinTrace:
    """Return a constant speed on a disc with errors until the memory is long and all is learned; then the speed changes
    evenly, a count is lost or is there twice, and the shaft stops, again and again after a few counts.
    """
    n = _SETTLED + _STOPPING
    noise = rng.choice([0, 1e-3, 0.02]) * rng.standard_normal(n)
    place = np.arange(1, n + 1) + np.resize(0.05 * rng.standard_normal(4), n) + noise
    gap = spec.timing.tick_cycles / rng.choice([0.3, 0.9, 1.1, 2.5], p=[0.1, 0.5, 0.2, 0.2])
    clock = gap * (place + rng.choice([0, 0, 1e-5, -1e-5]) * np.maximum(place - n * 2 // 3, 0) ** 2)
    clock = np.cumsum(np.maximum(np.diff(np.rint(clock), prepend=0), 1 + spec.filter_clocks)).astype(np.int64)
    length = spec.timing.tick_cycles
    clock[_SETTLED:] += np.cumsum(length * rng.choice([0, 3, 9, 14, 30], _STOPPING, p=[0.6, 0.1, 0.1, 0.1, 0.1]))
    step = np.full(n, rng.choice([-1, 1]))
    at = int(rng.integers(_SETTLED - 100, _SETTLED - 10))
    step[at : at + int(rng.integers(1, 4))] *= rng.choice([0, 2, -1])
    last = np.arange(clock[-1] // length + int(rng.choice([3, 40]))) * length + length - 1
    if spec.external_tick:
        last += rng.integers(-9, 10, len(last))
    return _ticked(spec, rng, clock, np.cumsum(step), last)


def sudden(spec: TrackTachometer, rng: np.random.Generator) -> PinTrace:
    """Return a few counts that begin at rest, as close as the filter lets them, at the end of a tick; then silence: no
    velocity is greater, and no acceleration.
    """
    length, least = spec.timing.tick_cycles, 1 + spec.filter_clocks
    last = np.arange(1, 8 * 40) * length - 1
    clock, step = [], []
    for part in range(8):
        gaps = rng.choice([*least * np.array([1, 1, 2, 3, 4, 5, 6, 10]), length], int(rng.integers(2, 9)))
        clock += [last[40 * part + int(rng.choice([1, 20, 30]))] - int(rng.integers(0, 20)) + np.cumsum(gaps)]
        step += [np.full(len(gaps), rng.choice([-1, 1]))]
    order = np.unique(np.concatenate(clock), return_index=True)
    return _ticked(spec, rng, order[0], np.cumsum(np.concatenate(step)[order[1]]), last)


def numbers(spec: TrackTachometer, rng: np.random.Generator) -> PinTrace:
    """Return a rest, and ticks with as many counts, forward or backward, as tell the bits of their number apart."""
    most = spec.timing.tick_cycles // (1 + spec.filter_clocks)
    near = np.add.outer(1 << np.arange(most.bit_length()), np.arange(-8, 9)).ravel()
    counts = np.unique(np.clip([*near, *-near], -most, most))
    return _of_counts(spec, np.append(np.zeros(2 * spec.timing.max_ticks, dtype=np.int64), rng.permutation(counts)))


def tracked(spec: TrackTachometer, rng: np.random.Generator) -> Iterator[PinTrace]:
    """Yield what a tracking core is played: first short motions, which end in the middle of a tick or of a program."""
    ticks = spec.tick.longest
    for _ in range(60):
        yield hostile(spec, rng, 6).until(int(rng.integers(1, 3 * ticks)))
    yield from ending(spec, rng)
    yield rattle(spec, rng)
    for number in range(12):
        yield (stress(spec, int(rng.integers(1 << 30)), 10), bursts(spec, rng), hostile(spec, rng, _TICKS))[number % 3]
    for _ in range(4):
        yield sudden(spec, rng)
    for _ in range(3):
        yield settled(spec, rng)
        yield hostile(spec, rng, 2 * _TICKS)


def _ticked(
    spec: TrackTachometer,
    rng: np.random.Generator,
    clock: NDArray[np.int64],
    quarter: NDArray[np.int64],
    last: NDArray[np.int64],
) -> PinTrace:
    """Return quarters of a period that begin in some clocks, and ticks that end with others."""
    n_clocks = int(last[-1]) + 1
    level = _levels(clock, quarter, n_clocks)
    (z,) = noise_lines(rng, n_clocks, 1)
    tick = np.isin(np.arange(n_clocks), last)
    return _trace(spec, np.array([level & 1, level >> 1, z, tick], dtype=np.uint8))


def ending(spec: TachometerSpec, rng: np.random.Generator) -> list[PinTrace]:
    """Return motions that end in each of the clocks about the end of a tick, and about an update, and a whole one."""
    found = []
    for before in range(-3, 10):
        for of_tick in (True, False):
            trace = noise(spec, rng, 4 * spec.tick.longest, 2)
            while not len((run := golden.run(spec, trace)).updates.clock):
                trace = noise(spec, rng, 4 * spec.tick.longest, 2)
            clocks = run.ticks.clock - spec.latency.tick if of_tick else run.updates.clock
            found.append(trace.until(max(int(rng.choice(clocks[:2])) - before, 1)))
    return [*found, noise(spec, rng, 4 * spec.tick.longest, 2)]


def _levels(clock: NDArray[np.int64], quarter: NDArray[np.int64], n_clocks: int) -> NDArray[np.uint8]:
    """Return a + 2 B in every clock, from the quarters of a period that begin in some; both lines are low before."""
    return quadrature(np.append(0, quarter)[np.searchsorted(clock, np.arange(n_clocks), side="right")])


def _trace(spec: TachometerSpec, level: NDArray[np.uint8]) -> PinTrace:
    """Return the trace with these levels of A, B, Z and the tick, as far as they are there."""
    names = _lines(spec)
    rows = level[[_LINES.index(name) for name in names]]
    clock = np.flatnonzero(np.append(True, (rows[:, 1:] != rows[:, :-1]).any(axis=0)))
    return PinTrace(clock, n_clocks=level.shape[1], **dict(zip(names, rows[:, clock], strict=True)))


def _lines(spec: TachometerSpec) -> list[str]:
    """Return inputs that are no clock and no reset, in the order of the ports."""
    return [port.name for port in spec.ports if port.name in _LINES]


def stimulus(spec: TachometerSpec, n_clocks: int, seed: int = 1) -> Stimulus:
    """Return motions, bursts and noise in turns, at least `n_clocks` of them, or ten times as many with long ticks."""
    rng = np.random.default_rng(seed)
    pins: list[NDArray[np.uint8]] = []
    traces: list[PinTrace] = []
    starts: list[int] = []
    done = 0
    shaken = False

    def add(trace: PinTrace, resets: int) -> None:
        """A motion, and clocks of reset before it."""
        nonlocal done
        level = np.zeros(trace.n_clocks, dtype=np.uint8)
        level[trace.clock] = 1
        row = np.cumsum(level) - 1
        played = packed([trace.lines[name] for name in _lines(spec)])[row] << np.uint8(1)
        reset = rng.integers(0, 256, resets).astype(np.uint8) | np.uint8(1)
        if not traces:
            reset = reset[:0]
        starts.append(done + len(reset))
        pins.extend([reset, played])
        traces.append(trace)
        done += len(reset) + trace.n_clocks

    while done < n_clocks and not isinstance(spec, TrackTachometer):
        if done > n_clocks // 4 and not shaken:
            trace, shaken = rattle(spec, rng), True
        elif len(traces) % 8 in (0, 4):
            trace = stress(spec, int(rng.integers(1 << 30)), _EDGES)
        elif len(traces) % 8 == 1:
            trace = noise(spec, rng, 40 * spec.tick.longest * spec.timing.max_ticks)
        elif len(traces) % 8 == 2:
            trace = bursts(spec, rng)
        elif len(traces) % 8 == 6:
            trace = steps(spec, rng)
            n_clocks += trace.n_clocks  # the others are as many as without them
        else:  # soon after a reset
            trace = noise(spec, rng, int(rng.integers(4, 3 * spec.tick.longest * spec.timing.max_ticks)), 2)
        # Some end early: the next reset comes in the middle.
        early = rng.random() < 0.5 and trace.n_clocks < _RATTLE
        trace = trace.until(int(rng.integers(1, trace.n_clocks)) if early else trace.n_clocks)
        add(trace, int(rng.choice([1, 1, 2, 5])))
    last: Iterable[PinTrace] = ()
    if isinstance(spec, TrackTachometer):
        add(numbers(spec, np.random.default_rng(seed)), 0)
        last = tracked(spec, rng)
    elif isinstance(spec, STachometer) and isinstance(spec.form.reciprocal, Reciprocal):
        last = [*ending(spec, rng), hard(spec, spec.form.reciprocal)]
    for trace in last:
        add(trace, 1)
    return Stimulus(np.concatenate(pins).astype(np.uint64)[:, np.newaxis], traces, starts)
