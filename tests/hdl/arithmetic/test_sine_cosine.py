"""Sine and cosine of every angle, and gates that agree with the golden model."""

import random
from typing import Any

import numpy as np
import pytest
from proofs.formal.mutants import mutant
from support.nightly import nightly
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import sine_cosine as sine_cosine_gates
from tachometry.hdl.arithmetic.sine_cosine import SineCosine, SineTable
from tachometry.sim.golden.extras.electrical import sine_by_table, sine_cosine
from tachometry.spec.formats.sine import ONE, STEPS


@pytest.mark.parametrize(("function", "most"), [(sine_cosine, 2.5), (sine_by_table, 1.7)])
def test_each_angle_has_its_sine_and_cosine(function: Any, most: float) -> None:
    angle = np.arange(1 << 16)
    exact = ONE * np.exp(2j * np.pi * angle / len(angle))
    for found, wanted in zip(function(angle), (exact.imag, exact.real), strict=True):
        assert np.abs(found - wanted).max() < most
        assert np.abs(found).max() <= ONE


def agrees(box: Any, function: Any = sine_cosine) -> bool:
    rng = random.Random(1)
    corners = [eighth << 13 | low for eighth in range(8) for low in (0, 0x1FFF)]
    angles = [*corners, *(rng.getrandbits(16) for _ in range(100)), 0]
    rows = [{"angle": angle ^ (clock % STEPS)} for angle in angles for clock in range(STEPS)]
    seen = clock_by_clock(box, rows, ["sin", "cos"])[STEPS + 1 :]
    wanted = np.repeat(np.array(function(np.array(angles))), STEPS, axis=1).T
    return [(row["sin"], row["cos"]) for row in seen] == [*map(tuple, wanted[: len(seen)].tolist())]


def test_gates_agree() -> None:
    assert agrees(SineCosine())
    assert agrees(SineTable(), sine_by_table)


@nightly
@pytest.mark.parametrize("right", ["of_x, y + of_x", "quadrant[0] ^ quadrant[1]", "first < 0, START"])
def test_wrong_gates_are_seen(right: str) -> None:
    wrong = right.replace("of_x, y + of_x", "of_x, y").replace("^", "&").replace("<", ">")
    with mutant(SineCosine, right, wrong):
        assert not agrees(sine_cosine_gates.SineCosine())


@nightly
@pytest.mark.parametrize("right", ["(cosine & quadrant[0])", " ^ mirrored ^ minus", "more.eq(128)"])
def test_wrong_gates_of_the_table_are_seen(right: str) -> None:
    with mutant(SineTable, right, right.replace(" ^ minus", "").replace("cosine &", "").replace("128", "0")):
        assert not agrees(sine_cosine_gates.SineTable(), sine_by_table)
