"""A few upsets of every method's flip-flops; `make upset` has thousands."""

import pytest
from proofs.formal.mutants import RECURSIVE_SUM
from proofs.upset.campaign import upsets
from support.mutant import mutant

from tachometry.hdl.methods.m import MovingSum
from tachometry.spec import METHODS


@pytest.mark.parametrize("method", METHODS)
def test_outputs_are_right_again_in_time(method: str) -> None:
    """Every bit once."""
    campaign = upsets(method, 700)
    assert campaign.fine
    assert len(campaign.bits) < 700
    assert (campaign.clocks == 0).any()
    assert campaign.clocks.max() > campaign.spec.timing.tick_cycles


def test_sum_that_is_carried_along_is_noticed() -> None:
    with mutant(MovingSum, *RECURSIVE_SUM):
        assert not upsets("m", 700).fine
