"""Upsets of a core's flip-flops, and the golden model to say when its outputs are right again."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from proofs.upset.simulate import Bits, Upsettable

from tachometry.sim import golden
from tachometry.sim.signals.axes import Trace
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import Run
from tachometry.spec import METHODS, Encoder, Speed, TachometerSpec, Timing
from tachometry.spec.control import AnySpec
from tachometry.spec.core.disc import Disc
from tachometry.spec.core.extras.disc import DiscFile, DiscMap
from tachometry.spec.core.extras.health import Health
from tachometry.spec.core.extras.over_speed import OverSpeed
from tachometry.spec.core.extras.position_compare import Compare, PositionCompare
from tachometry.spec.core.extras.probe import Probe
from tachometry.spec.core.index import Index

TICK_CYCLES, MAX_TICKS = 100, 20
# What a core of M may have beside, which must not keep the velocity from recovering; proofs are about these outputs.
OUTPUTS = "m, outputs"
MAPPED = ("t, map", "mt, map", "s, map")  # their turn has 40 edges
FAR = tuple((0.4 * np.sin(np.arange(40) * np.pi / 20)).tolist())
_MAP = DiscMap(file=DiscFile("", Disc(40, FAR, 4, 2, 0.01, 0.05, (60.0, 150.0), 40.0, False)))
_OPTIONS: dict[str, dict[str, Any]] = {
    "m": {"average": 10},
    OUTPUTS: {
        "index": Index(once=True),
        "preset": 0,
        "position_modulo": "7",
        "extras": (
            Health(differential=4),
            OverSpeed(limit=Speed.parse("1rad/s")),
            Probe(probes="both"),
            PositionCompare(places=Compare(2, 3, 0, "7clk", "both")),
        ),
    },
    **{
        name: {"encoder": Encoder(10, 4), "index": Index(), "extras": (_MAP,), "bounds": name in MAPPED[:2]}
        for name in (*MAPPED, "track, map")
    },
    "track": {"timing": Timing(5_000_000, 340, 20), "max_speed": Speed.parse("75rev/s"), "multiplier": "block"},
    "track, serial": {"timing": Timing(5_000_000, 1000, 20), "multiplier": "serial"},
}
# Of `track` the rounding, and the noise and the offsets that it learns gradually, outlive every rest: after an upset it
# is not equal in all bits again, see tracking.py.
UPSET = [method for method in METHODS if method != "track"]


def spec_of(name: str) -> TachometerSpec:
    """Return a core like the default one, with shorter ticks and a shorter maximum time, so that the campaign ends; of
    a method, `OUTPUTS`, of `MAPPED`, or tracking without a multiplier block.
    """
    method = name.split(",")[0]
    options: dict[str, Any] = {
        "encoder": Encoder(500, 4),
        "timing": Timing(5_000_000, TICK_CYCLES, MAX_TICKS),
        "age": True,
        "bounds": METHODS[method].facts.bounds,
    }
    return METHODS[method](**options | _OPTIONS.get(method, {}) | _OPTIONS.get(name, {}))


def motion(spec: TachometerSpec, n_cycles: int, seed: int) -> PinTrace:
    """Return speeds of up to 2.5 counts per tick either way, a new one every few ticks; stops longer than the maximum
    time.

    - `n_cycles`: Stops; from one to the next it is about three times the maximum time.
    """
    rng = np.random.default_rng(seed)
    cycles, longest = spec.timing.tick_cycles, spec.timing.max_ticks
    clocks, turns = [0.0], [0]
    now = 0.0
    for _ in range(n_cycles):
        end = now + cycles * rng.uniform(1.4 * longest, 1.7 * longest)
        while now < end:
            speed = 2.5 ** rng.uniform(-2, 1) * rng.choice([1, 1, 1, -1])
            until = now + cycles * rng.uniform(2, 9)
            while now < until:
                now += cycles / abs(speed) * rng.uniform(0.9, 1.1)
                clocks.append(now)
                turns.append(int(np.sign(speed)))
        now += cycles * rng.uniform(longest + 2, longest + 8)
    level, one = quadrature(np.cumsum(turns)), np.uint8(1)
    z = (np.cumsum(turns) % 40 == (0 if spec.displacement is None else 2)).astype(np.uint8) if spec.index else None
    return PinTrace(np.round(clocks).astype(np.int64), level & one, level >> one, int(now), z).completed(spec)


def dense(spec: TachometerSpec, run: Run) -> dict[str, NDArray[np.int64]]:
    """Return the value of each output in every clock; shape (n_clocks,).

    The age is that of the clocks of ticks, 0 in others.
    """
    clocks = np.arange(run.n_clocks)

    def held(strobe: NDArray[np.int64], values: NDArray[Any]) -> NDArray[np.int64]:
        return np.append(0, values)[np.searchsorted(strobe, clocks, side="right")].astype(np.int64)

    def high(strobe: NDArray[np.int64]) -> NDArray[np.int64]:
        found = np.zeros(run.n_clocks, dtype=np.int64)
        found[strobe] = 1
        return found

    ticks, found = run.ticks, dict[str, NDArray[np.int64]]()
    for strobe, table in run.tables.items():
        found[strobe] = high(table.clock)
        found |= {name: held(table.clock, values) for name, values in table.columns.items()}
    found["age"] = np.zeros(run.n_clocks, dtype=np.int64)
    found["age"][ticks.clock] = ticks.age
    return found


@dataclass(frozen=True)
class Campaign:
    """Holds the outcome of the upsets of a core.

    - `bit`, `clocks`, `allowed`, shape (n,): The bit that was flipped, clocks until the outputs were right again (0: it
      was never seen), and clocks after which they must be.
    """

    name: str
    spec: AnySpec
    bits: Bits
    bit: NDArray[np.int64]
    clocks: NDArray[np.int64]
    allowed: NDArray[np.int64]

    @property
    def fine(self) -> bool:
        """Whether the outputs were right in time, always."""
        return bool(np.all(self.clocks <= self.allowed))

    @property
    def ticks(self) -> NDArray[np.float64]:
        """The times in ticks, of those that were seen."""
        return self.clocks[self.clocks > 0] / self.spec.timing.tick_cycles


def right_rows(spec: TachometerSpec, trace: PinTrace, phase: int) -> NDArray[np.int64]:
    """Return what the golden model shows whose windows end in clocks `phase`, `phase` + T …; outputs in order of the
    ports.
    """
    last = np.arange(phase, trace.n_clocks - spec.latency.tick, spec.timing.tick_cycles, dtype=np.int64)
    with patch.object(golden, "windows", lambda *_: (last, np.empty(0, dtype=np.int64))):
        found = dense(spec, golden.run(spec, trace))
    return np.stack([found[name] for name in compared_names(spec)], axis=1)


def compared_names(spec: TachometerSpec) -> list[str]:
    """Return the outputs that are compared."""
    plain, own = spec_of(spec.method), {port.name for port in spec.ports}
    names = [port.name for port in plain.ports if port.direction == "output" and port.name != "position"]
    return [name for name in names if name in own]


def allowed(spec: TachometerSpec, trace: PinTrace, clock: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return clocks after which the outputs must be right if there was an upset in these clocks.

    What forgets only gradually forgets all at rest: when there is no count for the maximum time, and before it there
    was one that is surely right. A map is right again at the second index, which agrees with the first one.
    """
    if spec.displacement is not None:
        index = np.append(golden.run(spec, trace).index.clock, [trace.n_clocks] * 3)
        second = index[np.searchsorted(index, np.minimum(clock + spec.recovery.front, trace.n_clocks)) + 1]
        return second - clock + np.int64(spec.recovery.clocks or 0)
    if spec.recovery.clocks is not None:
        return np.full(len(clock), spec.recovery.clocks)
    silent = np.flatnonzero(
        np.diff(trace.clock, append=trace.n_clocks) > (spec.timing.max_ticks + 1) * spec.tick.longest
    )
    last = trace.clock[silent]  # counts before a rest
    rest = (spec.timing.max_ticks + 1) * spec.tick.longest + spec.latency.pin_to_count + spec.latency.tick
    found = np.searchsorted(last, clock + spec.recovery.front)
    return np.append(last, trace.n_clocks)[found] + rest + spec.latency.tick_to_velocity - clock


def upsets(name: str, n: int, seed: int = 1) -> Campaign:
    """Flip every bit as often as any other, at random clocks, `n` times in all, and see how long that is seen.

    Right are the outputs that the golden model gives for these pins with the core's own ticks.
    """
    spec = spec_of(name)
    trace = motion(spec, 40, seed)
    core = Upsettable(spec, trace)
    if spec.displacement is not None:  # the map would be right again with a new configuration alone
        core.bits = Bits(core.bits.flip_flops, [])
    end = allowed(spec, trace, np.arange(trace.n_clocks))
    outputs = [port.name for port in spec.ports if port.direction == "output"]
    compared = [outputs.index(name) for name in compared_names(spec)]
    tick, age = (compared_names(spec).index(name) for name in ("tick", "age"))
    expected: dict[int, NDArray[np.int64]] = {}

    def wrong(clock: int, rows: NDArray[np.int64]) -> NDArray[np.bool_]:
        shown = rows[:, compared]
        shown[:, age] *= shown[:, tick]
        phase = 0
        if not spec.facts.own_ticks and shown[:, tick].any():
            own = clock + np.flatnonzero(shown[:, tick])[-1] - spec.latency.tick
            phase = int(own % spec.timing.tick_cycles)
        if phase not in expected:
            expected[phase] = right_rows(spec, trace, phase)
        right = expected[phase][clock : clock + len(shown)]
        return (shown != right).any(axis=1)

    return play(name, spec, core, trace, n, end, seed, wrong)


def play(
    name: str,
    spec: AnySpec,
    core: Upsettable,
    trace: Trace,
    n: int,
    allowed: NDArray[np.int64],
    seed: int,
    wrong: Callable[[int, NDArray[np.int64]], NDArray[np.bool_]],
    only: str | tuple[str, ...] = "",
    first: int = 200 * TICK_CYCLES,
) -> Campaign:
    """Flip bits as in `upsets`.

    - `allowed`, shape (n_clocks,): Clocks after which the outputs must be right, by the clock of the upset.
    - `wrong`: Of the clock of an upset, and what was shown from it on, in which clocks it is wrong.
    - `only`: Bits of this register alone, or of these, by the end of its name.
    - `first`: Clock of the earliest upset.
    """
    rng = np.random.default_rng(seed)
    places = [place for place, register in enumerate(core.bits.names) if register.endswith(only)]
    length = int(allowed[: trace.n_clocks // 2].max()) + 3 * spec.timing.tick_cycles
    clock = np.sort(rng.integers(first, trace.n_clocks - length, n))
    bit = rng.permutation(np.resize(rng.permutation(places), n))
    clocks = np.zeros(n, dtype=np.int64)
    for number, at, rows in core.runs(clock, bit, length):
        shown = rows[np.searchsorted(at, np.arange(length), side="right") - 1]
        late = np.flatnonzero(wrong(int(clock[number]), shown))
        clocks[number] = late[-1] + 1 if len(late) else 0
    return Campaign(name, spec, core.bits, bit, clocks, allowed[clock])


def by_register(campaign: Campaign) -> Iterator[tuple[str, int]]:
    """Yield registers by the longest time that an upset of theirs was seen, longest first."""
    names = campaign.bits.names
    longest: dict[str, int] = {}
    for bit, clocks in zip(campaign.bit.tolist(), campaign.clocks.tolist(), strict=True):
        longest[names[bit]] = max(longest.get(names[bit], 0), clocks)
    yield from sorted(longest.items(), key=lambda item: -item[1])
