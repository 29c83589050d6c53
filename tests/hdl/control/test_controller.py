"""Observer and controller against the golden ones, with made-up updates, positions and commands."""

import numpy as np
import pytest
from support.control import CONVENTIONAL, SERIAL, SMALL, TRACKING, UNFILTERED, WITH_INPUTS, check
from support.nightly import only

SPECS = {"synchronised": SMALL, "conventional": CONVENTIONAL, "unfiltered": UNFILTERED, "inputs": WITH_INPUTS}


# Of the four, these two have all that the others have, and both ways of gains.
FEW = ("synchronised", "inputs")


@pytest.mark.parametrize("name", only(FEW[1:], SPECS))
def test_with_the_greatest_numbers(name: str) -> None:
    spec = SPECS[name]
    wanted = check(spec, 40)
    assert np.mean(wanted.current_saturated) > 0.8
    assert np.abs(wanted.filtered_velocity).max() > spec.form.most_y / 8


@pytest.mark.parametrize("name", only(FEW, SPECS))
def test_with_numbers_that_saturate_now_and_then(name: str) -> None:
    wanted = check(SPECS[name], 50, less=8)
    assert 0.2 < np.mean(wanted.current_saturated) < 0.8
    assert len(np.unique(wanted.current)) > 15


def test_with_a_serial_multiplier() -> None:
    check(SERIAL, 25, less=8)


def test_only_ticks_with_counts_are_updates_for_the_observer() -> None:
    """Of a method that updates in every tick, what comes in a tick without a count is only held."""
    wanted = check(TRACKING, 80, less=8)
    assert len(np.unique(wanted.filtered_velocity)) > 6
