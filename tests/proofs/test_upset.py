"""A few upsets of every method's flip-flops; `make upset` has thousands."""

import pytest
from proofs.formal.mutants import RECURSIVE_SUM
from proofs.upset.campaign import upsets
from support.mutant import mutant

from tachometry.hdl.methods.m import MovingSum
from tachometry.hdl.methods.track_machine import TrackMachine
from tachometry.spec import METHODS


@pytest.mark.parametrize("method", METHODS)
def test_outputs_are_right_again_in_time(method: str) -> None:
    """Every bit once; of `track`, which takes longer, every third."""
    n = 330 if method == "track" else 700
    campaign = upsets(method, n)
    assert campaign.fine
    assert len(campaign.bits) < (3 * n if method == "track" else n)
    assert (campaign.clocks == 0).any()
    assert campaign.clocks.max() > campaign.spec.timing.tick_cycles


def test_what_a_rest_leaves_is_noticed() -> None:
    """A program that does not forget the level of λ at rest."""
    with mutant(TrackMachine, "m.d.sync += level.eq(self._next_level(now.address, level))", "pass"):
        assert not upsets("track", 330).fine


def test_sum_that_is_carried_along_is_noticed() -> None:
    with mutant(MovingSum, *RECURSIVE_SUM):
        assert not upsets("m", 700).fine
