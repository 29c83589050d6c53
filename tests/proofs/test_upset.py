"""A few upsets of every method's flip-flops, and of other cores'; `make upset` has thousands."""

import pytest
from proofs.formal.mutants import mutant
from proofs.upset import angle, axes, loops, tracking
from proofs.upset.campaign import MAPPED, OUTPUTS, UPSET, upsets
from support.nightly import nightly

from tachometry.hdl.control.control_clock import ControlClock
from tachometry.hdl.extras import disc, electrical


@nightly
@pytest.mark.parametrize("name", [*UPSET, OUTPUTS, *MAPPED])
def test_outputs_are_right_again_in_time(name: str) -> None:
    """Every bit once."""
    campaign = upsets(name, 1000)
    assert campaign.fine
    assert len(campaign.bits) < 1000
    assert (campaign.clocks == 0).any()
    assert campaign.clocks.max() > campaign.spec.timing.tick_cycles


@nightly
def test_a_place_in_the_turn_that_stays_wrong_is_noticed() -> None:
    with mutant(disc.Gates, "place.eq(self._place), ", ""):
        assert not upsets("mt, map", 350).fine


@nightly
def test_many_axes_are_right_again_in_time() -> None:
    """Every second bit."""
    campaign = axes.upsets(450)
    assert campaign.fine
    assert (campaign.clocks > 0).sum() > 30
    assert campaign.clocks.max() > campaign.spec.timing.tick_cycles


@nightly
def test_an_angle_is_right_again_at_the_second_index() -> None:
    """Every fifth bit."""
    campaign = angle.upsets(150)
    assert campaign.fine
    assert (campaign.clocks > 0).sum() > 10
    with mutant(electrical.Gates, "Mux(zeroes, first, angle)", "angle"):
        assert not angle.upsets(10, only="sum__").fine


@nightly
def test_the_velocity_of_tracking_is_right_again_in_time() -> None:
    """Every fortieth bit of the flip-flops and words."""
    campaign = tracking.upsets("track", 90)
    assert campaign.fine
    assert len(campaign.bits) > campaign.bits.n_flip_flops + 2000
    assert 0 < (campaign.clocks > 0).sum() < 30


@nightly
def test_tracking_with_a_map_is_right_again_in_time() -> None:
    campaign = tracking.upsets("track, map", 90)
    assert campaign.fine
    assert (campaign.clocks > 0).sum() > 10


@nightly
def test_a_control_loop_is_right_again_in_time() -> None:
    """Every sixth bit."""
    campaign = loops.upsets("loop", 110)
    assert campaign.fine
    assert (campaign.clocks > 0).sum() > 15
    assert campaign.ticks.max() > 20  # z forgets when there is no current


@nightly
def test_a_control_clock_that_stands_beyond_its_end_is_noticed() -> None:
    with mutant(ControlClock, "left.eq(left - 1)", "left.eq(left - (left < max(self._first, self._period)))"):
        assert not loops.upsets("loop", 20, only="control__clock_2e_left").fine
