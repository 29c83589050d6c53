"""Bounds of the methods that work on ticks enclose the mean speed of every window, and no less would; means of M."""

import math
from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from numpy.typing import NDArray
from reference.front import Tick
from reference.ideal_motion import SUBCOUNTS, motion
from reference.sequences import rounded
from reference.settings import Settings
from reference.tsuji import m_updates
from support.nightly import nightly

from tachometry.sim.golden import model
from tachometry.sim.golden.methods.m import Model
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, MTachometer, STachometer, TachometerSpec, Timing


def ticks_of(angle: NDArray[np.int64]) -> Table:
    """Return what an ideal encoder shows of it, a tick in every clock."""
    m_e = np.diff(angle // SUBCOUNTS)
    return Table(np.arange(len(m_e)), {"pulse_count": m_e})


S = STachometer(encoder=Encoder(500), timing=Timing(1_000_000, 32, 500), bounds=True)
PLAIN = replace(S, cancel=False, frac_bits=8)
M = MTachometer(encoder=Encoder(500), timing=Timing(1_000_000, 32, 500), bounds=True)


def true_travel(
    spec: TachometerSpec, angle: NDArray[np.int64], at: NDArray[np.int64], m_s: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Return twice the angle travelled in the windows that close with the ticks `at`, in 1/`SUBCOUNTS`.

    The angles begin a tick before the first that is counted. Eq. (21) is the mean of two windows, of which one lies a
    tick before the other.
    """
    later = angle[at + 2] - angle[at + 2 - m_s]
    earlier = angle[at + 1] - angle[at + 1 - m_s]
    return later + (earlier if getattr(spec, "cancel", False) else later)


def displaced(spec: TachometerSpec, angle: NDArray[np.int64], seed: int) -> NDArray[np.int64]:
    """Return how much later than that of an ideal disc each edge comes: half because of the disc, half of the lines."""
    rng = np.random.default_rng(seed)
    most = int(spec.bound.edge_error * SUBCOUNTS) // 2
    disc = rng.choice([0, most], 101) if seed % 2 else rng.integers(0, most + 1, 101)
    return disc[angle // SUBCOUNTS % 101] + rng.integers(0, most + 1, len(angle))


def check_enclosure(spec: TachometerSpec, n_motions: int, n_ticks: int = 250_000) -> tuple[int, float]:
    """Return every window of random motions; how many there were, and how near the truth came to a bound, in counts."""
    windows, nearest = 0, 1.0
    for seed in range(n_motions):
        angle = motion(n_ticks + 1, spec.tick.max_count, seed)
        seen = angle[1:] - displaced(spec, angle[1:], seed)
        updates = model(spec).updates(ticks_of(seen), None, 1 << 40)
        at = updates.clock - spec.latency.tick_to_velocity
        m_s, valid = updates.interval, updates["bounds_valid"]
        windows += int(np.count_nonzero(valid))
        # Twice the travel in LSB · ticks, so that all is whole.
        travel = true_travel(spec, angle, at, m_s) << spec.velocity.native_frac_bits
        above = (2 * updates["velocity_upper"] * m_s * SUBCOUNTS - travel)[valid]
        below = (travel - 2 * updates["velocity_lower"] * m_s * SUBCOUNTS)[valid]
        assert (above >= 0).all(), f"seed {seed}: above the upper bound at {at[valid][above < 0][:1]}"
        assert (below >= 0).all(), f"seed {seed}: below the lower bound at {at[valid][below < 0][:1]}"
        width = updates["velocity_upper"] - updates["velocity_lower"]
        assert (width * m_s < 2 * (1 + spec.bound.edge_error) * (1 << spec.velocity.native_frac_bits) + 2 * m_s).all()
        scale = 2 * SUBCOUNTS << spec.velocity.native_frac_bits
        nearest = min(nearest, above.min() / scale, below.min() / scale)
    return windows, nearest


@pytest.mark.parametrize(
    ("spec", "n_motions", "least"),
    [
        (S, 4, 100_000),
        pytest.param(S, 12, 300_000, marks=nightly),
        pytest.param(PLAIN, 12, 300_000, marks=nightly),
        pytest.param(M, 2, 490_000, marks=nightly),
        pytest.param(replace(M, average=5), 1, 240_000, marks=nightly),
    ],
    ids=["eq. (21)", "more of it", "eq. (17)", "M", "M of 5"],
)
def test_discs_and_lines_within_the_edge_error(spec: TachometerSpec, n_motions: int, least: int) -> None:
    for error in (Fraction(3, 8), Fraction(1)):
        windows, nearest = check_enclosure(replace(spec, edge_error=error), n_motions // 2 or 1)
        assert windows > least // 2
        assert nearest < 0.5
    # Bounds of an ideal disc do not enclose it.


NUMBERS = [0, 0, 5, -5, 1, 0, 0, 0, 0, 0, -1, 2, 2, 2, 3, -3, 3, -3, -7, 20, 20, 20, -20, -20, -20, -20]


@pytest.mark.parametrize("edge_error", [Fraction(0), Fraction(1, 8), Fraction(1)])
@pytest.mark.parametrize("frac_bits", [4, 11])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 7, 8])
def test_means_are_correctly_rounded_and_enclosed(n: int, frac_bits: int, edge_error: Fraction) -> None:
    """A window may have missed a count at its ends, and its edges may be off; ticks before the first are empty."""
    timing = Timing(1_000_000, 20, 10)
    spec = MTachometer(
        encoder=Encoder(8), timing=timing, average=n, frac_bits=frac_bits, bounds=True, edge_error=edge_error
    )
    clock = 21 + 20 * np.arange(len(NUMBERS))
    found = Model(spec).updates(Table(clock, {"pulse_count": np.array(NUMBERS)}), None, 10_000)
    ticks = [Tick(k, number, False, 0, not number) for k, number in enumerate(NUMBERS)]
    wanted = m_updates(Settings("m", {"average": str(n), "edge-error": str(edge_error)}), ticks)
    one = 2**frac_bits
    assert found.clock.tolist() == (clock + spec.latency.datapath).tolist()
    assert found.velocity.tolist() == [rounded(update.speed, frac_bits) for update in wanted]
    assert found["velocity_lower"].tolist() == [math.floor((update.lower or 0) * one) for update in wanted]
    assert found["velocity_upper"].tolist() == [math.ceil((update.upper or 0) * one) for update in wanted]
    # The line before the first tick is not known: this is a tick that a window may not contain.
    assert found["bounds_valid"].tolist() == [update.known for update in wanted]
    assert set(found.interval.tolist()) == {n}
    assert not found.forced.any()
