"""No number of the tracking program leaves its word, for any counts; and its outputs are those of the golden model."""

import os

import numpy as np
import pytest
from support.lockstep import random_case
from support.tracking import Interpreter, hostile, tick_of

from tachometry.sim.golden.methods.track import Model, Windows, rounded
from tachometry.sim.signals.run import Table
from tachometry.spec import TrackTachometer
from tachometry.spec.formats.tracking_program import Phase

CASES, TICKS = int(os.environ.get("CASES", "40")), 400


def check(spec: TrackTachometer, seed: int, n_ticks: int = TICKS) -> int:
    """Run hostile counts through the program and through the golden model; the bits of the widest number."""
    rng = np.random.default_rng(seed)
    steps, last = hostile(spec, rng, n_ticks)
    windows = Windows.of(steps, last)
    position = rng.integers(-(1 << spec.position_width - 1), 1 << spec.position_width - 1, n_ticks)
    ticks = Table(last + spec.tick_latency, {"position": position})
    updates = Model(spec).updates(ticks, steps, int(last[-1]) + 1)
    core = Interpreter(spec.program)
    silent = spec.timing.max_ticks
    phases = [Phase.REST, Phase.REST]
    half, shift = 1 << (spec.position_width + spec.fine_bits - 1), spec.form.frac_bits - spec.fine_bits
    for i in range(n_ticks):
        alone = silent > 0 or phases[-2] != Phase.TRACKS
        clocks = core.run(tick_of(spec, windows, i, alone, silent + 1 >= spec.timing.max_ticks))[-1][0]
        assert clocks == spec.program.clocks
        phases.append(core.phase)
        silent = 0 if windows.number[i] else silent + 1
        fine = (int(position[i]) << spec.fine_bits) + rounded(core.x, shift)
        shown = (core.mq, core.ac, (fine + half) % (2 * half) - half)
        names = ("velocity", "acceleration", "position_fine")
        assert shown == tuple(int(updates[name][i]) for name in names), f"seed {seed}, tick {i}"
        assert abs(core.mq) < 1 << (spec.native_width - 1)
        assert abs(core.ac) < 1 << (spec.acceleration_width - 1)
    return core.widest


@pytest.mark.parametrize("seed", range(CASES))
def test_hostile_counts(seed: int) -> None:
    spec, *_ = random_case(seed, "track")
    assert isinstance(spec, TrackTachometer)
    widest = check(spec, seed)
    print(seed, spec.form.width, widest)
