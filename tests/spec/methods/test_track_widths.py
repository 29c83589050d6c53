"""No number of the tracking program leaves its word, for any counts; and its outputs are those of the golden model."""

import numpy as np
import pytest
from support.lockstep import random_case
from support.tracking import Interpreter, hostile, ticks_of

from tachometry.sim.golden.methods.track import Model, Windows, rounded
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer

CASES, TICKS = 40, 400


def check(spec: TrackTachometer, seed: int, n_ticks: int = TICKS) -> int:
    """Run hostile counts through the program and through the golden model; the bits of the widest number."""
    rng = np.random.default_rng(seed)
    steps, last = hostile(spec, rng, n_ticks)
    windows = Windows.of(steps, last)
    position = rng.integers(-(1 << spec.position_width - 1), 1 << spec.position_width - 1, n_ticks)
    ticks = Table(last + spec.tick_latency, {"position": position})
    updates = Model(spec).updates(ticks, steps, int(last[-1]) + 1)
    core = Interpreter(spec.program)
    half, shift = 1 << (spec.position_width + spec.fine_bits - 1), spec.form.frac_bits - spec.fine_bits
    for i, tick in enumerate(ticks_of(spec, windows, core)):
        assert core.run(tick)[-1].clocks == spec.program.clocks
        fine = (int(position[i]) << spec.fine_bits) + rounded(core.x, shift)
        shown = (core.mq, core.ac, (fine + half) % (2 * half) - half)
        names = ("velocity", "acceleration", "position_fine")
        assert shown == tuple(int(updates[name][i]) for name in names), f"seed {seed}, tick {i}"
        assert abs(core.mq) < 1 << (spec.native_width - 1)
        assert abs(core.ac) < 1 << (spec.acceleration_width - 1)
    return core.widest


@pytest.mark.parametrize("seed", range(CASES))
def test_hostile_counts(seed: int) -> None:
    """The widest number comes near the end of its word."""
    spec, *_ = random_case(seed, "track")
    assert isinstance(spec, TrackTachometer)
    assert check(spec, seed) >= spec.form.width - 6
