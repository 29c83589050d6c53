"""The bounds of the methods that measure times enclose the true mean speed, by whole numbers."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import nightly

from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, MTTachometer, Timing, TTachometer
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.methods.timed import TimedTachometer

INSTANTS = 1 << 10  # in a clock
TICK = 20

Ints = NDArray[np.int64]


def edges(n: int, seed: int) -> tuple[Ints, Ints]:
    """Return when an ideal shaft passes edges, in 1/`INSTANTS` clocks, at most one a clock, and in which direction."""
    rng = np.random.default_rng(seed)
    parts: list[NDArray[Any]] = []
    while sum(map(len, parts)) < n:
        m = int(rng.integers(1, 3000))
        gap = 10.0 ** rng.uniform(0, 2.5) * np.linspace(1, rng.uniform(0.3, 3), m)
        parts.append(gap * (1 + rng.choice([0, 0.9]) * rng.uniform(-1, 1, m)))
    gaps = np.maximum(np.concatenate(parts)[:n], 1) * INSTANTS
    gaps[rng.random(n) < 1e-4] *= 300
    turns = np.where(rng.random(n) < rng.choice([0.001, 0.3]), -1, 1)
    return np.cumsum(np.ceil(gaps).astype(np.int64)) + 10 * INSTANTS, np.cumprod(turns)


def check_silence(spec: TimedTachometer, updates: Table) -> None:
    """Without a count the shaft may have come within a hair of the next edge, and over none."""
    forced = updates.forced & updates["bounds_valid"]
    lasted = (updates.interval * spec.times.interval_unit)[forced]
    lower, upper = (updates[name][forced] * lasted for name in BOUNDS)
    off = int(spec.bound.edge_error * (TICK << spec.velocity.native_frac_bits))
    one, velocity = (TICK << spec.velocity.native_frac_bits) + off, updates.velocity[forced]
    assert (velocity == 0).sum() > 5
    assert ((upper >= one) & (upper < one + lasted))[velocity >= 0].all()
    assert ((lower <= -one) & (lower > -one - lasted))[velocity <= 0].all()
    if spec.bound_decay:
        assert (velocity != 0).sum() > 5
    # While the velocity decays, the shaft has not come back over its last edge; after a reversal it may go either way.
    near = ((lower <= -off) & (lower > -off - lasted), (upper >= off) & (upper < off + lasted))
    assert (near[0] | (lower <= -one))[velocity > 0].all()
    assert (near[1] | (upper >= one))[velocity < 0].all()


def check_enclosure(spec: TimedTachometer, n: int, seed: int = 1) -> tuple[int, float, float]:
    """Return how many were checked, the least distance from truth to bound in LSB, the median of (upper −
    lower)/|truth|.
    """
    time, step = edges(n, seed)
    clock = -(-time // INSTANTS)
    n_clocks = int(clock[-1]) + 10 * TICK
    none = np.empty(0, np.int64)
    tick = np.arange(TICK - 1, n_clocks, TICK)
    through = np.append(0, np.cumsum(step))
    m_e = np.diff(through[np.searchsorted(clock, tick, side="right")], prepend=0)
    ticks = Table(tick + spec.latency.tick, {"pulse_count": m_e})
    updates = model(spec).updates(ticks, Steps(clock, step, none, none, none), n_clocks)

    # The edge that each count is: on the lattice the last in the tick that leads to where the tick ends.
    updates = updates.rows(updates.clock < n_clocks)
    end = updates.clock - spec.latency.datapath - spec.latency.tick
    if spec.form.on_lattice:
        period = np.searchsorted(tick, clock)
        leads = (step == np.sign(m_e)[period]) & (through[1:] == through[np.searchsorted(clock, tick, "right")][period])
        edge_of = np.full(len(tick), -1)
        np.maximum.at(edge_of, period[leads], np.flatnonzero(leads))
        end = np.searchsorted(tick, end)
        last = edge_of[end]
        first = edge_of[end - updates.interval]
    else:
        last, first = (np.searchsorted(clock, at) for at in (end, end - updates.interval))
    check_silence(spec, updates)
    chosen = ~updates.forced & updates["bounds_valid"]
    last, first = last[chosen], first[chosen]
    # Where the shaft is when it passes: half a count before or after the counts on its sides.
    way = through[last + 1] - through[first + 1] - (step[last] - step[first]) // 2
    # Each edge comes later by up to the edge error: half because of the disc, half of the lines.
    rng, most = np.random.default_rng(seed), int(8 * spec.bound.edge_error)
    late = rng.integers(0, most + 1, 64)[(through[1:] + through[:-1] + 1) // 2 % 64] + rng.integers(
        0, most + 1, len(step)
    )
    way = 16 * way + late[last] - late[first]
    scale = INSTANTS * TICK << spec.velocity.native_frac_bits
    lasted = time[last] - time[first]
    lower, upper = updates["velocity_lower"][chosen], updates["velocity_upper"][chosen]
    above, below = upper == spec.velocity.absent_bound, lower == -spec.velocity.absent_bound  # there is none
    assert (below | (16 * lower * lasted <= way * scale)).all()
    assert (above | (16 * upper * lasted >= way * scale)).all()
    if not spec.form.saturates:
        # A velocity that decays is that of half a count more than can have been.
        measured = updates["bounds_valid"] & ~(updates.forced & (updates.velocity != 0))
        assert (updates["velocity_lower"] <= updates.velocity)[measured].all()
        assert (updates["velocity_upper"] >= updates.velocity)[measured].all()
    finite = ~above & ~below & (way != 0)
    exact = way[finite] * scale / (16 * lasted[finite])
    lower, upper = lower[finite], upper[finite]
    nearest = np.minimum(upper - exact, exact - lower).min()
    return len(way), float(nearest), float(np.median((upper - lower) / np.abs(exact)))


OPTIONS: dict[str, Any] = {"encoder": Encoder(500), "timing": Timing(1_000_000, TICK, 500), "bounds": True}
T, MT = TTachometer(**OPTIONS), MTTachometer(**OPTIONS, min_time=100)


@pytest.mark.parametrize(
    ("spec", "n"),
    [
        # Both timers and both methods are in the two that are short.
        pytest.param(replace(T, frac_bits=8), 1_500_000, marks=nightly),
        (MT, 1_000_000),
        (replace(T, timer="tick"), 500_000),
        pytest.param(replace(MT, timer="tick"), 1_000_000, marks=nightly),
    ],
    ids=["T", "M/T", "T, ticks", "M/T, ticks"],
)
def test_true_mean_speed_is_always_enclosed(spec: TimedTachometer, n: int) -> None:
    checked, nearest, width = check_enclosure(spec, n)
    assert checked > 200_000
    assert nearest < 1
    assert width < 0.5


@pytest.mark.parametrize("timer", ["clock", "tick"])
@pytest.mark.parametrize("method", [T, MT], ids=["T", "M/T"])
def test_discs_and_lines_within_the_edge_error(method: TimedTachometer, timer: str) -> None:
    spec = replace(method, timer=timer, frac_bits=8, edge_error=Fraction(3, 8))
    checked, nearest, _ = check_enclosure(spec, 200_000)
    assert checked > 25_000
    assert nearest < 1 << 8
    # Bounds of an ideal disc do not enclose it.
