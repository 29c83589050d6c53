"""Observer and controller against the golden ones, with made-up updates, positions and commands."""

from dataclasses import replace

import numpy as np
import pytest
from support.control import (
    CONVENTIONAL,
    GENERATED,
    OFTEN,
    SERIAL,
    SMALL,
    TRACKING,
    UNFILTERED,
    WITH_INPUTS,
    check,
    random_demands,
)
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.control import command_generator
from tachometry.sim.golden.command_generator import Demand, generated
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.generator import AMPLITUDE_WIDTH, SINE, WORD, generator_clocks

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


COMMANDS = ("command_position", "command_velocity", "command_acceleration")


def check_generator(spec: LoopSpec, n_ticks: int, seed: int = 1, *, fast: bool = False) -> None:
    """Hold a generator against the golden one, with ticks as close as they may be, or not.

    If it is `fast`, it has no bound of the velocity that would keep a sine from its greatest way.
    """
    form = replace(spec.generator, velocity_bits=58, velocity_shift=27) if fast else spec.generator
    rng = np.random.default_rng(seed)
    given = {name.removeprefix("generator_"): values for name, values in random_demands(spec, rng, n_ticks).items()}
    if fast:  # it leaves the middle of the greatest sine at its greatest velocity
        given["mode"][:60] = SINE
        given["amplitude"][:60] = -1 << (AMPLITUDE_WIDTH - 1)
        given["rate"][:60] = np.where(abs(np.arange(60) - 32) > 17, (1 << WORD) - 1, 0)
    given["enable"] = ((rng.random(n_ticks) < 0.93) | (fast & (np.arange(n_ticks) < 60))).astype(np.int64)
    turn = 1 << (spec.tachometer.position_width - 1)
    position = rng.integers(-turn, turn, n_ticks)
    clock = 2 + np.cumsum(generator_clocks(spec.multiplier) + rng.integers(0, 2, n_ticks))
    rows: list[dict[str, int]] = [{"tick": 0, "position": 1, **dict.fromkeys(given, 0)} for _ in range(clock[-1] + 1)]
    for k, at in enumerate(clock.tolist()):
        rows[at] |= {"tick": 1, "position": int(position[k]), **{name: int(given[name][k]) for name in given}}
    demands = [Demand(*values) for values in zip(*(column.tolist() for column in given.values()), strict=True)]
    wanted = generated(form, position.tolist(), demands)
    box = command_generator.CommandGenerator(form, spec.multiplier)
    seen = [row for row, told in zip(clock_by_clock(box, rows, COMMANDS), rows, strict=True) if told["tick"]]
    assert [tuple(row[name] for name in COMMANDS) for row in seen] == [
        (one.position, one.velocity, one.acceleration) for one in wanted
    ]


# Forty demands have every mode several times.
@pytest.mark.parametrize("n_ticks", only([40], [40, 600]))
def test_as_the_golden_model(n_ticks: int) -> None:
    check_generator(GENERATED, n_ticks)
    check_generator(GENERATED, 64, fast=True)


def test_with_control_ticks_in_2_microseconds() -> None:
    """An LSB of the acceleration is less than one of the port there."""
    assert OFTEN.generator.acceleration.shift < 0
    check_generator(OFTEN, 20)
