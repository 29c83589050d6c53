"""Windows of whole cycles of the lines: what they are for, and that none is longer than twice T_c allows."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods import mt
from tachometry.sim.signals.run import Table
from tachometry.sim.studies.plan import plan_at
from tachometry.spec import Encoder, MTTachometer, Timing, of_texts

Ints = NDArray[np.int64]
TICK, MIN_TIME = 20, 100
RANDOM = MTTachometer(encoder=Encoder(500), timing=Timing(1_000_000, TICK, 500), min_time=MIN_TIME, whole_cycles=True)


def random_counts(n: int, seed: int) -> tuple[Ints, Ints]:
    """Return clocks of counts from one to some hundred clocks apart, and steps with few or with many reversals."""
    rng = np.random.default_rng(seed)
    gaps = np.concatenate([10 ** rng.uniform(0, 2.2) * rng.uniform(0.3, 1.7, 50) for _ in range(n // 50)])
    gaps[rng.random(n) < 0.003] += 500 * TICK
    turns = np.repeat(rng.choice([0.0, 0.003, 0.3], n // 50), 50)
    return np.cumsum(np.ceil(gaps).astype(np.int64)) + 10, np.cumprod(np.where(rng.random(n) < turns, -1, 1))


def windows(spec: MTTachometer, clock: Ints, step: Ints) -> tuple[Ints, Ints]:
    """Return which of the counts open and close the measurements of the golden model."""
    none, n_clocks = np.empty(0, np.int64), int(clock[-1]) + 10 * TICK
    tick = np.arange(TICK - 1, n_clocks, TICK)
    ticks = Table(tick + spec.latency.tick, {"pulse_count": np.zeros(len(tick), np.int64)})
    updates = mt.Model(spec).updates(ticks, Steps(clock, step, none, none, none), n_clocks)
    measured = updates.rows(~updates.forced & (updates.clock < n_clocks))
    end = measured.clock - spec.latency.datapath - spec.latency.tick
    return np.searchsorted(clock, end - measured.interval), np.searchsorted(clock, end)


def check_windows(decoding: int, seed: int) -> None:
    """Each window against the rule, count by count."""
    spec = MTTachometer(
        encoder=Encoder(500, decoding), timing=RANDOM.timing, min_time=MIN_TIME, whole_cycles=True, bound_decay=False
    )
    clock, step = random_counts(20_000, seed)
    why = {"whole": 0, "turned": 0, "short": 0, "too long": 0}
    for opening, closing in zip(*windows(spec, clock, step), strict=True):
        at, way = opening, 0
        while True:
            at += 1
            way += int(step[at]) if step[at] == step[at - 1] else 0
            lasted = clock[at] - clock[opening]
            if lasted <= MIN_TIME:
                continue
            turned = bool((step[opening : at + 1] != step[opening]).any())
            reasons = way % decoding == 0, turned, abs(way) < decoding, lasted > 2 * MIN_TIME
            if any(reasons):
                break
        why[list(why)[reasons.index(True)]] += 1
        assert at == closing, (opening, closing, at)
    assert min(why.values()) > 15, why


@pytest.mark.parametrize("decoding", [2, 4])
def test_windows_by_the_rule(decoding: int) -> None:
    check_windows(decoding, decoding)


def test_no_window_is_longer_than_one_of_twice_the_minimum_time() -> None:
    """From the count that opened it, and where a cycle takes longer than the minimum time, no longer than without."""
    clock, step = random_counts(50_000, 1)
    opening, closing = windows(RANDOM, clock, step)
    assert (closing <= np.searchsorted(clock, clock[opening] + 2 * MIN_TIME, side="right")).all()
    plain = np.searchsorted(clock, clock[opening] + MIN_TIME, side="right")
    slow = plain - opening < 4
    assert (closing == plain)[slow].all()
    assert (closing > plain)[~slow].sum() > 500


def test_at_x1_nothing_changes() -> None:
    texts = {"ppr": "500", "decoding": "1", "tick": "40clk", "max-time": "4000clk", "min-time": "200clk"}
    trace = VirtualEncoder(500, jitter=0.3).record(parse_motion("sine:900rad/s:50Hz:40ms")).recording.place(48_000_000)
    runs = [golden.run(of_texts("mt", texts | {"whole-cycles": one}), trace).updates for one in ("yes", "no")]
    assert len(runs[0]) > 100
    for one, other in zip(vars(runs[0]).values(), vars(runs[1]).values(), strict=True):
        np.testing.assert_equal(one, other)


DRIVE = {"ppr": "500", "clock": "10MHz", "tick": "100us", "min-time": "300us"}


def errors(speed: float, **options: str) -> Any:
    """Return errors of the updates in rad/s; the lines are 20 degrees apart from their places, and as much too wide."""
    encoder = VirtualEncoder(500, phase_error_deg=20, duty_error_deg=20)
    recording = encoder.record(parse_motion(f"constant:{speed}rad/s:50ms")).recording
    spec = of_texts("mt", DRIVE | options)
    updates = golden.run(spec, recording.place(spec.timing.clock_hz)).updates
    return updates.velocity[3:] * spec.velocity.rad_per_s_per_lsb - speed


@pytest.mark.parametrize("decoding", ["4", "2"])
def test_phase_and_duty_errors_cancel(decoding: str) -> None:
    """The error that is left is the clock that an edge is late."""
    for speed in (217.0, 87.0):
        spec = of_texts("mt", DRIVE | {"decoding": decoding, "whole-cycles": "yes"})
        (resolution,) = plan_at(spec, np.array([speed])).resolution
        assert np.abs(errors(speed, decoding=decoding, **{"whole-cycles": "yes"})).max() < resolution
        assert np.abs(errors(speed, decoding=decoding)).max() > 10 * resolution
