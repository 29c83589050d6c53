"""The values of the T and M/T methods: what decays, and how long times in external ticks are."""

import numpy as np
import pytest
from support.nightly import only

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.stress import stress
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.signals.recording import PinTrace, quadrature
from tachometry.sim.signals.run import Table
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.methods.timed import TimedTachometer

DRIVE = {"ppr": "2500", "clock": "100MHz", "tick": "100us", "max-speed": "4000rpm", "min-time": "500us"}
EXTERNAL = {"ppr": "500", "timer": "tick", "external-tick": "yes"}


def rms(spec: TachometerSpec, motion: str, begin: float, end: float, jitter: float = 0.03) -> tuple[float, Table]:
    """Return RMS of the error of the held velocity in rad/s from `begin` to `end` in seconds, and all updates."""
    encoding = VirtualEncoder(2500, jitter=jitter, seed=1).record(parse_motion(motion))
    updates = golden.run(spec, encoding.recording.place(spec.timing.clock_hz)).updates
    instants = np.arange(begin, end, 1e-5)
    at = np.searchsorted(updates.clock, instants * spec.timing.clock_hz, side="right") - 1
    error = updates.velocity[at] * spec.velocity.rad_per_s_per_lsb - encoding.motion.speed(instants)
    return float(np.sqrt(np.mean(np.square(error)))), updates


def test_nothing_decays_while_counts_come() -> None:
    """The edges of a real disc come up to some per cent late; a window of five ticks holds what is made of that."""
    error, updates = rms(of_texts("mt", DRIVE), "constant:3000rpm:500ms", 0.02, 0.5)
    assert error < 0.1
    assert not updates.forced[updates.clock > 1000].any()
    # Some come more than half a count late, but in ticks that are full of others; each tick asks at another phase.
    _, updates = rms(of_texts("mt", DRIVE), "constant:2977rpm:500ms", 0.02, 0.5, jitter=0.3)
    assert not updates.forced[updates.clock > 1000].any()


def test_a_stop_is_seen() -> None:
    error, updates = rms(of_texts("mt", DRIVE), "constant:20rad/s:100ms+stop:100ms", 0.1, 0.2)
    assert error < 1
    assert updates.velocity[-1] == 0


def counting(n_ticks: int, tick: int, gap: int) -> PinTrace:
    """Return a trace of steady counts and external ticks."""
    clock = np.arange(0, n_ticks * tick, gap)
    level = quadrature(np.arange(len(clock)))
    trace = PinTrace(clock, level & np.uint8(1), level >> np.uint8(1), n_ticks * tick)
    return trace.with_tick_in(np.arange(tick, n_ticks * tick, tick))


@pytest.mark.parametrize("method", ["t", "mt"])
def test_times_in_external_ticks_are_counted_in_ticks(method: str) -> None:
    spec = of_texts(method, EXTERNAL)
    updates = golden.run(spec, counting(200, 960, 960)).updates
    moving = updates.rows(~updates.forced)
    assert set(moving.interval[1:].tolist()) == {1 if method == "t" else 2}
    assert len(moving) > 90


def test_a_short_maximum_time_in_external_ticks_is_no_longer() -> None:
    spec = of_texts("t", EXTERNAL | {"tick": "50clk", "max-time": "100clk"})
    updates = golden.run(spec, counting(300, 50, 10**6)).updates
    assert set(np.diff(updates.clock).tolist()) == {2 * 50}
    assert set(updates.interval.tolist()) == {2}


# Both have the same divider. A seed is another rhythm of the ticks; that of the first is the shortest.
@pytest.mark.parametrize("method", only(["mt"], ["t", "mt"]))
@pytest.mark.parametrize("seed", only([0], range(3)))
def test_ticks_that_are_shorter_than_a_division(method: str, seed: int) -> None:
    """They come at every second to twentieth clock: windows stay open, and zeros take the divider."""
    spec = of_texts(method, EXTERNAL | {"tick": "40clk", "max-time": "120clk", "bounds": "yes", "frac-bits": "4"})
    rng = np.random.default_rng(seed)
    trace = stress(of_texts(method, {"ppr": "500", "tick": "12clk", "max-time": "36clk"}), seed, 60)
    trace = trace.with_tick_in(np.cumsum(rng.integers(2, rng.choice([4, 21]), trace.n_clocks // 4)))
    assert isinstance(spec, TimedTachometer)
    found = lockstep(spec, trace, PySim())
    assert found.n_mismatches == 0, f"seed {seed}: {found.first}"
    updates = found.actual.updates
    assert np.count_nonzero(updates.velocity) > 20
    assert np.diff(updates.clock).min() >= spec.form.division_clocks
