"""No number of the tracking program leaves its word, for any counts; and its outputs are those of the golden model."""

import numpy as np
import pytest
from support.lockstep import random_case
from support.nightly import only
from support.tracking import Interpreter, hostile, ticks_of

from tachometry.sim.golden.methods.track import Model, Windows, rounded
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer, of_texts
from tachometry.spec.formats.tracking import LEVELS
from tachometry.spec.formats.tracking_code import Phase

CASES, TICKS = 40, 400


def check(spec: TrackTachometer, seed: int, n_ticks: int = TICKS) -> int:
    """Run hostile counts through the program and through the golden model; the bits of the widest number."""
    rng = np.random.default_rng(seed)
    steps, last = hostile(spec, rng, n_ticks)
    windows = Windows.of(steps, last)
    position = rng.integers(-(1 << spec.position_width - 1), 1 << spec.position_width - 1, n_ticks)
    ticks = Table(last + spec.latency.tick, {"position": position})
    updates = Model(spec).updates(ticks, steps, int(last[-1]) + 1)
    core = Interpreter(spec.program)
    half, shift = 1 << (spec.position_width + spec.fine_bits - 1), spec.form.frac_bits - spec.fine_bits
    for i, tick in enumerate(ticks_of(spec, windows, core)):
        assert core.run(tick)[-1].clocks == spec.program.clocks
        fine = (int(position[i]) << spec.fine_bits) + rounded(core.x, shift)
        shown = (core.mq, core.ac, (fine + half) % (2 * half) - half)
        names = ("velocity", "acceleration", "position_fine")
        assert shown == tuple(int(updates[name][i]) for name in names), f"seed {seed}, tick {i}"
        assert abs(core.mq) < 1 << (spec.widths.native - 1)
        assert abs(core.ac) < 1 << (spec.acceleration.width - 1)
    return core.widest


# Each runs hundreds of ticks of another core; every tenth has each option at least once.
@pytest.mark.parametrize("seed", only(range(0, CASES, 10), range(CASES)))
def test_hostile_counts(seed: int) -> None:
    """The widest number comes near the end of its word."""
    spec, *_ = random_case(seed, "track")
    assert isinstance(spec, TrackTachometer)
    assert check(spec, seed) >= spec.form.width - 6


@pytest.mark.parametrize(
    ("longest", "options"),
    [
        ("683us", {}),  # U is more than half of 1/λ_0 from here on
        ("5ms", {"agile": "no"}),
        ("11ms", {"bandwidth": "200rad/s", "frac-bits": "8"}),
        ("200us", {"bandwidth": "20kHz"}),
    ],
)
def test_ticks_that_may_be_much_shorter_than_the_longest(longest: str, options: dict[str, str]) -> None:
    """The unit of time follows the longest tick, so gains are greater than elsewhere."""
    core = {"ppr": "500", "clock": "48MHz", "max-speed": "1000rad/s", "external-tick": "yes"}
    spec = of_texts("track", core | {"max-tick-period": longest} | options)
    assert isinstance(spec, TrackTachometer)
    assert spec.form.ratio_range > 0
    check(spec, 1)


@pytest.mark.parametrize("seed", only([CASES, CASES + 3], range(CASES, CASES + 20)))
def test_states_at_their_limits(seed: int) -> None:
    """Wherever v, a and the level of λ are and however long it has lasted, whatever the counts were before."""
    spec, *_ = random_case(seed, "track")
    assert isinstance(spec, TrackTachometer)
    rng, program = np.random.default_rng(seed), spec.program
    core = Interpreter(program)
    for tick in ticks_of(spec, Windows.of(*hostile(spec, rng, TICKS)), core):
        if core.phase == Phase.TRACKS and rng.random() < 0.5:
            core.memory[program.address("v")] = int(rng.choice([-1, 1])) * spec.form.max_velocity
            core.memory[program.address("a")] = int(rng.choice([-1, 0, 1])) * spec.form.max_acceleration
            core.level = int(rng.integers(LEVELS)) if spec.growing_memory else 0
            core.memory[program.address("age")] = spec.form.spans[core.level] - 1
        core.run(tick)
