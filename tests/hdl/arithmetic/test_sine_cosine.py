"""Sine and cosine of every angle, and gates that agree with the golden model."""

import random
from typing import Any

import numpy as np
import pytest
from proofs.formal.mutants import mutant
from support.nightly import nightly
from support.simulate import clock_by_clock

from tachometry.hdl.arithmetic import sine_cosine as sine_cosine_gates
from tachometry.hdl.arithmetic.sine_cosine import SineCosine
from tachometry.sim.golden.extras.electrical import sine_cosine
from tachometry.spec.formats.sine import ONE, STEPS


def test_each_angle_has_its_sine_and_cosine() -> None:
    angle = np.arange(1 << 16)
    exact = ONE * np.exp(2j * np.pi * angle / len(angle))
    for found, wanted in zip(sine_cosine(angle), (exact.imag, exact.real), strict=True):
        assert np.abs(found - wanted).max() < 2.5
        assert np.abs(found).max() <= ONE


def agrees(box: Any) -> bool:
    rng = random.Random(1)
    corners = [eighth << 13 | low for eighth in range(8) for low in (0, 0x1FFF)]
    angles = [*corners, *(rng.getrandbits(16) for _ in range(100)), 0]
    rows = [{"angle": angle ^ (clock % STEPS)} for angle in angles for clock in range(STEPS)]
    seen = clock_by_clock(box, rows, ["sin", "cos"])[STEPS + 1 :]
    wanted = np.repeat(np.array(sine_cosine(np.array(angles))), STEPS, axis=1).T
    return [(row["sin"], row["cos"]) for row in seen] == [*map(tuple, wanted[: len(seen)].tolist())]


def test_gates_agree() -> None:
    assert agrees(SineCosine())


@nightly
@pytest.mark.parametrize("right", ["of_x, y + of_x", "quadrant[0] ^ quadrant[1]", "first < 0, START"])
def test_wrong_gates_are_seen(right: str) -> None:
    wrong = right.replace("of_x, y + of_x", "of_x, y").replace("^", "&").replace("<", ">")
    with mutant(SineCosine, right, wrong):
        assert not agrees(sine_cosine_gates.SineCosine())
