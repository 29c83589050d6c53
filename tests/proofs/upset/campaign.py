"""Upsets of a core's flip-flops, and the golden model to say when its outputs are right again."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from proofs.upset.simulate import Bits, Upsettable

from tachometry.sim import golden
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import Run
from tachometry.spec import METHODS, Encoder, TachometerSpec, Timing

TICK_CYCLES, MAX_TICKS = 100, 20
_OPTIONS: dict[str, dict[str, Any]] = {"m": {"average": 10}}
_OF_POSITION = ("position", "index_position", "swallowed_edges")


def spec_of(method: str) -> TachometerSpec:
    """A core like the default one, with shorter ticks and a shorter maximum time, so that the campaign ends."""
    return METHODS[method](
        encoder=Encoder(500, 4),
        timing=Timing(5_000_000, TICK_CYCLES, MAX_TICKS),
        age=True,
        bounds=True,
        **_OPTIONS.get(method, {}),
    )


def motion(n_cycles: int, seed: int) -> PinTrace:
    """Speeds of up to 2.5 counts per tick either way, a new one every few ticks; stops longer than the maximum time.

    Parameters
    ----------
    n_cycles : int
        Stops; from one to the next it is about 60 ticks.
    seed : int
    """
    rng = np.random.default_rng(seed)
    clocks, turns = [0.0], [0]
    now = 0.0
    for _ in range(n_cycles):
        end = now + TICK_CYCLES * rng.uniform(28, 34)
        while now < end:
            speed = 2.5 ** rng.uniform(-2, 1) * rng.choice([1, 1, 1, -1])
            until = now + TICK_CYCLES * rng.uniform(2, 9)
            while now < until:
                now += TICK_CYCLES / abs(speed) * rng.uniform(0.9, 1.1)
                clocks.append(now)
                turns.append(int(np.sign(speed)))
        now += TICK_CYCLES * rng.uniform(MAX_TICKS + 2, MAX_TICKS + 8)
    level, one = quadrature(np.cumsum(turns)), np.uint8(1)
    return PinTrace(np.round(clocks).astype(np.int64), level & one, level >> one, int(now))


def dense(spec: TachometerSpec, run: Run) -> dict[str, NDArray[np.int64]]:
    """What is shown in every clock, by output, but for the position; shape (n_clocks,).

    The age is that of the clocks of ticks, 0 in others.
    """
    clocks = np.arange(run.n_clocks)

    def held(strobe: NDArray[np.int64], values: NDArray[Any]) -> NDArray[np.int64]:
        return np.append(0, values)[np.searchsorted(strobe, clocks, side="right")].astype(np.int64)

    def high(strobe: NDArray[np.int64]) -> NDArray[np.int64]:
        found = np.zeros(run.n_clocks, dtype=np.int64)
        found[strobe] = 1
        return found

    ticks, updates = run.ticks, run.updates
    found = {name: held(ticks.clock, values) for name, values in ticks.columns.items() if name not in _OF_POSITION}
    found |= {name: held(updates.clock, values) for name, values in updates.columns.items()}
    found["tick"], found["velocity_valid"] = high(ticks.clock), high(updates.clock)
    found["decode_error"] = high(run.errors)
    found["age"] = np.zeros(run.n_clocks, dtype=np.int64)
    found["age"][ticks.clock] = ticks.age
    return found


@dataclass(frozen=True)
class Campaign:
    """What became of the upsets of a core.

    Parameters
    ----------
    spec : TachometerSpec
    bits : Bits
    bit, clocks : int64 arrays, shape (n,)
        The bit that was flipped, and clocks until the outputs were right again; 0: it was never seen.
    """

    spec: TachometerSpec
    bits: Bits
    bit: NDArray[np.int64]
    clocks: NDArray[np.int64]

    @property
    def bound(self) -> int:
        """Clocks after which the outputs must be right."""
        clocks = self.spec.recovery_clocks
        assert clocks is not None
        return clocks

    @property
    def fine(self) -> bool:
        """Whether they always were."""
        return bool(np.all(self.clocks <= self.bound))

    @property
    def ticks(self) -> NDArray[np.float64]:
        """The same in ticks, of those that were seen."""
        return self.clocks[self.clocks > 0] / self.spec.timing.tick_cycles


def _expected(spec: TachometerSpec, trace: PinTrace, phase: int) -> NDArray[np.int64]:
    """What the golden model shows whose windows end in clocks `phase`, `phase` + T …; outputs in order of the ports."""
    last = np.arange(phase, trace.n_clocks - spec.tick_latency, spec.timing.tick_cycles, dtype=np.int64)
    with patch.object(golden, "windows", lambda *_: (last, np.empty(0, dtype=np.int64))):
        found = dense(spec, golden.run(spec, trace))
    return np.stack([found[name] for name in _compared(spec)], axis=1)


def _compared(spec: TachometerSpec) -> list[str]:
    return [port.name for port in spec.ports if port.direction == "output" and port.name not in _OF_POSITION]


def upsets(method: str, n: int, seed: int = 1, n_cycles: int = 40) -> Campaign:
    """Flip every bit as often as any other, at random clocks, `n` times in all, and see how long that is seen.

    Right are the outputs that the golden model gives for these pins with the core's own ticks.
    """
    spec, trace = spec_of(method), motion(n_cycles, seed)
    core = Upsettable(spec, trace)
    rng = np.random.default_rng(seed)
    assert spec.recovery_clocks is not None
    length = spec.recovery_clocks + 3 * spec.timing.tick_cycles
    clock = np.sort(rng.integers(200 * TICK_CYCLES, trace.n_clocks - length, n))
    bit = rng.permutation(np.resize(rng.permutation(len(core.bits)), n))
    outputs = [port.name for port in spec.ports if port.direction == "output"]
    compared = [outputs.index(name) for name in _compared(spec)]
    tick, age = (_compared(spec).index(name) for name in ("tick", "age"))
    clocks = np.zeros(n, dtype=np.int64)
    expected: dict[int, NDArray[np.int64]] = {}
    for number, at, rows in core.runs(clock, bit, length):
        shown = rows[:, compared][np.searchsorted(at, np.arange(length), side="right") - 1]
        shown[:, age] *= shown[:, tick]
        phase = 0
        if not spec.own_ticks and shown[:, tick].any():
            own = clock[number] + np.flatnonzero(shown[:, tick])[-1] - spec.tick_latency
            phase = int(own % spec.timing.tick_cycles)
        if phase not in expected:
            expected[phase] = _expected(spec, trace, phase)
        wrong = np.flatnonzero((shown != expected[phase][clock[number] : clock[number] + length]).any(axis=1))
        clocks[number] = wrong[-1] + 1 if len(wrong) else 0
    return Campaign(spec, core.bits, bit, clocks)


def by_register(campaign: Campaign) -> Iterator[tuple[str, int]]:
    """Registers by the longest time that an upset of theirs was seen, longest first."""
    names = [name for name, width in (*campaign.bits.flip_flops, *campaign.bits.memories) for _ in range(width)]
    longest: dict[str, int] = {}
    for bit, clocks in zip(campaign.bit.tolist(), campaign.clocks.tolist(), strict=True):
        longest[names[bit]] = max(longest.get(names[bit], 0), clocks)
    yield from sorted(longest.items(), key=lambda item: -item[1])
