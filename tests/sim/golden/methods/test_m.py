"""The golden M method: means of the last n pulse numbers, by exact fractions."""

import math
from fractions import Fraction

import numpy as np
import pytest
from reference.front import Tick
from reference.sequences import rounded
from reference.settings import Settings
from reference.tsuji import m_updates

from tachometry.sim.golden.methods.m import Model
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, MTachometer, Timing

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
