"""The datapaths of the methods that measure times, in gates: to the bit those of the golden model."""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.methods import DATAPATHS
from tachometry.hdl.methods.quotient_velocity import QuotientVelocity
from tachometry.sim.golden import model
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.signals.run import Table
from tachometry.spec import METHODS, Encoder, Speed, Timing
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.methods.timed import TimedTachometer

CLOCKS, TICK, MAX_TICKS = 2400, 20, 20
OUTPUTS = ["velocity", "interval", "forced"]


def spec_of(method: str, **options: Any) -> TimedTachometer:
    """Return ticks of 20 clocks, a little more than a division takes, and at most 20 of them."""
    timing = Timing(100 * TICK, TICK, MAX_TICKS)
    spec = METHODS[method](**{"encoder": Encoder(25), "timing": timing, "frac_bits": 8, **options})
    assert isinstance(spec, TimedTachometer)
    return spec


def counts(seed: int) -> NDArray[np.int64]:
    """Return a step for every clock: steady and fast, in either direction, over one edge, and silence up to three
    times.
    """
    rng = np.random.default_rng(seed)
    step = np.zeros(CLOCKS, np.int64)
    at, way = 100, 1
    while at < CLOCKS:
        gap, turns = [(1, 0.2), (3, 0.5), (9, 0.1), (23, 0), (41, 0.3), (60, 0.2)][rng.integers(6)]
        for _ in range(rng.integers(1, 8)):
            if at < CLOCKS:
                way *= -1 if rng.random() < turns else 1
                step[at] = way
            at += gap + int(rng.integers(2))
        at += int(rng.integers(250)) * (rng.random() < 0.3)
    return step


def check(spec: TimedTachometer, step: NDArray[np.int64]) -> NDArray[np.int64]:
    """Check all updates of steps by their clocks, and that they stay; return them: clock and outputs."""
    n, cycles = len(step), spec.timing.tick_cycles
    tick, m_e = np.arange(cycles - 1, n, cycles), step.reshape(-1, cycles).sum(axis=1)
    none, at, n_clocks = np.empty(0, np.int64), np.flatnonzero(step), n + spec.latency.datapath
    steps = Steps(at - spec.latency.tick, step[at], none, none, none)
    golden = model(spec).updates(Table(tick, {"pulse_count": m_e}), steps, n_clocks)
    golden = golden.rows(golden.clock < n_clocks)
    rows = []
    for clock in range(n_clocks):
        row = {"coming": int(clock < n and clock % cycles == cycles - 2)}
        if spec.form.on_lattice:
            window = min(clock, n - 1) // cycles
            row |= {"next_count": int(m_e[window]), "pulse_count": int(m_e[window])}
        else:
            row["step_before"] = int(step[clock + 1]) if clock + 1 < n else 0
        rows.append(row)
    names = OUTPUTS + [*BOUNDS, "bounds_valid"] * spec.bounds
    seen = clock_by_clock(DATAPATHS[spec.method](spec), rows, ["velocity_valid", *names])
    held = dict.fromkeys(OUTPUTS, 0)
    for row in seen:
        held = row if row["velocity_valid"] else held
        assert all(row[name] == held[name] for name in OUTPUTS)
    got = [[clock, *(row[name] for name in names)] for clock, row in enumerate(seen) if row["velocity_valid"]]
    wanted = np.stack([golden[name].astype(np.int64) for name in ("clock", *names)], axis=1)
    assert got == wanted.tolist()
    return wanted


SHORT = Timing(100 * TICK, TICK, 4)
CASES: list[tuple[str, dict[str, Any]]] = [
    *((method, {"timer": timer, "bounds": True}) for method in ("t", "mt") for timer in ("clock", "tick")),
    *((method, {"paper_exact": True}) for method in ("t", "mt")),
    *((method, {"max_speed": Speed.parse("2rev/s"), "bound_decay": False}) for method in ("t", "mt")),
    ("mt", {"whole_cycles": True, "min_time": 50}),
    ("mt", {"whole_cycles": True, "min_time": 30, "encoder": Encoder(50, 2), "bound_decay": False}),
]


@pytest.mark.parametrize("seed", only([1], [1, 2]))
@pytest.mark.parametrize(("method", "options"), CASES, ids=str)
def test_every_update(method: str, options: dict[str, Any], seed: int) -> None:
    spec = spec_of(method, **{"timing": SHORT, **options})
    found = check(spec, counts(seed))
    assert len(found) > 15
    assert not spec.bounds or len(np.unique(found[:, -1])) == 2
    assert (np.abs(found[:, 1]).max() == 2 << 8) or not spec.form.saturates


def test_a_distance_that_the_divider_does_not_take_is_held() -> None:
    """A window so long and so fast is held at the greatest speed."""
    for time in (205, 400):
        spec = spec_of("mt", min_time=time - 1, bound_decay=False, max_speed=Speed.parse("2rev/s"))
        # In half counts, times the clocks in a tick. The first, less what the divider does not take, would be next to
        # nothing; the second still fits its register, but not when it is doubled.
        most, distance = 1 << (len(QuotientVelocity(spec).divider.dividend) - 2), 2 * TICK * time
        assert 0 < distance - most < TICK if time == 205 else 2 * most - distance < 2 * TICK * TICK
        for sign in (1, -1):
            step = np.zeros(420, np.int64)
            step[5 : 6 + time] = sign
            assert check(spec, step)[0, 1:3].tolist() == [sign * 2 << 8, time]


def test_a_reversal_meets_an_edge_twice() -> None:
    """The distance is half of the ends and all between; to the letter, the counts after the opening one."""
    step, counts = np.zeros(180, np.int64), [1, 1, -1, -1, -1, 1, -1, -1, -1, 1, 1]
    step[[5, 15, 25, 35, 45, 60, 70, 80, 115, 125, 170]] = counts
    for options, ways in (({"bound_decay": False}, (-1, -2, 1)), ({"paper_exact": True}, (-1, -3, 2))):
        found = check(spec_of("mt", min_time=50, **options), step)
        assert found[:, 1].tolist() == [round(Fraction(way * TICK, 55) * 256) for way in ways]


def test_ticks_may_be_shorter_than_a_division() -> None:
    """A velocity that decays looks at its own sign, not at that of the one before it."""
    for late in (0, 7, 13):
        step = np.zeros(200, np.int64)
        step[[5, 45, 65, 72 + late]] = [1, 1, -1, -1]
        for method in ("t", "mt"):
            spec = spec_of(method, **({"min_time": 1} if method == "mt" else {}))
            check(replace(spec, timing=Timing(800, 8, 50)), step)
