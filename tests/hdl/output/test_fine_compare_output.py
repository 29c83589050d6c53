"""Pulses between counts against their rules, clock by clock; tests/independent has where the shaft is."""

from fractions import Fraction

import numpy as np
import pytest
from support.nightly import nightly
from support.simulate import clock_by_clock

from tachometry.hdl.output import fine_compare_output
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.cxxrtl import Cxxrtl
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_texts
from tachometry.spec.core.compare import Compare
from tachometry.spec.formats.carrying import Carrying
from tachometry.spec.formats.velocity_output import VelocityOutput

SEEN = ["position_compare", "position_compare_valid", "position_compare_position", "position_compare_count"]
CARRYING = Carrying(VelocityOutput(Fraction(1, 10), 200, 12), shift=1, position_fine_bits=2, more_bits=2, late=12)
SPACING = CARRYING.latency + 4
WIDTH, HALF = 5, 1 << 8  # bits of a position in counts; of the place that is carried on, without its sign


def wrapped(value: int, half: int) -> int:
    return (value + half) % (2 * half) - half


CASES = ["1.25:2.5:0:3clk:fine", "-3:0.75:30:3clk:backward:fine"]


@pytest.mark.parametrize("asked", CASES)
def test_every_clock_is_as_the_rules_say(asked: str) -> None:
    """Play updates whose places follow from each other more or less, with jumps now and then."""
    compare = Compare.parse("position_compare", asked)
    rng = np.random.default_rng(1)
    rows, fine, velocity = [], 0, 0
    for clock in range(3000):
        if valid := int(clock % SPACING == 10):
            velocity = int(rng.integers(-100, 101)) if rng.random() < 0.5 else velocity
            fine = wrapped(fine + SPACING * velocity // 20 + int(rng.integers(-3, 4)), HALF >> 2)
        row = {"valid": valid, "velocity": velocity, "position_fine": fine, "moves": int(rng.random() < 0.005)}
        rows.append({**row, "tick": int(clock % SPACING == 5)})
    box = fine_compare_output.FineCompareOutput(compare, 3, WIDTH, CARRYING, 8)
    seen = clock_by_clock(box, rows, SEEN)
    sign = -1 if compare.direction == "backward" else 1
    awaited, apart = compare.in_lsb(compare.start, 2), sign * compare.in_lsb(compare.step, 2)
    place, turn, begun = 0, 0, list[int]()
    armed = of_tick = of_update = moved = False
    wanted = dict.fromkeys(SEEN, 0)
    for clock, row in enumerate(rows):
        wanted["position_compare"] = int(bool(begun) and clock - begun[-1] < 3)
        wanted["position_compare_valid"] = int(bool(begun) and clock == begun[-1])
        assert seen[clock] == wanted, (asked, clock)
        if row["tick"]:
            of_tick, moved = moved, False
        moved = moved or bool(row["moves"])
        of_update = of_tick if row["valid"] else of_update
        beyond = wrapped((place >> 2) - awaited, HALF >> 2)
        ahead = beyond < 0 if sign > 0 else beyond >= 0
        if armed and not ahead and (not compare.count or len(begun) < compare.count):
            begun.append(clock + 1)
            wanted |= {"position_compare_position": awaited, "position_compare_count": len(begun)}
            awaited = wrapped(awaited + apart, HALF >> 2)
        armed = armed or ahead
        place = wrapped(place + turn, HALF)
        update = clock + 1 - CARRYING.latency
        if update >= 0 and rows[update]["valid"]:  # it is the place from the next clock on
            turn = CARRYING.per_clock.scaled(2 * rows[update]["velocity"])
            place = wrapped((rows[update]["position_fine"] << 2) + 8 * turn * CARRYING.adds, HALF)
            armed = armed and not of_update
    assert len(begun) == compare.count or len(begun) > 20


@nightly  # a build takes seconds; the matrix has another core
def test_hardware_is_the_golden_model() -> None:
    texts = {"ppr": "20", "clock": "1MHz", "tick": "1000clk", "max-time": "4000clk", "position-fine-bits": "3"}
    more = {"position-width": "8", "index": "yes", "index-reset": "yes", "preset": "3"}
    spec = of_texts("track", {**texts, **more, "position-compare": "1.5:1.25:40:1clk:fine"})
    found = lockstep(spec, stress(spec, 1, 60), Cxxrtl())
    assert found.n_mismatches == 0, found.first
    assert len(found.actual.tables["position_compare_valid"]) > 20
