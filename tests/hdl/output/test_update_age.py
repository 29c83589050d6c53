"""Ticks since the update, clock by clock."""

import numpy as np
import pytest
from support.mutant import caught, mutant
from support.simulate import clock_by_clock

from tachometry.hdl.output import update_age


def check() -> None:
    rng = np.random.default_rng(1)
    rows = [{"tick": int(tick), "update": int(update)} for tick, update in rng.random((400, 2)) < (0.6, 0.15)]
    seen = [row["age"] for row in clock_by_clock(update_age.UpdateAge(5), rows, ["age"])]
    wanted, ticks = [], 0
    for row in rows:
        ticks = 0 if row["update"] else ticks
        wanted.append(min(ticks, 5))
        ticks += row["tick"]
    assert seen == wanted
    assert set(wanted) == set(range(6))


def test_counts_ticks_since_the_update() -> None:
    check()


MUTANTS = {
    "wraps": ("(self.tick & (self.age != self._max_age))", "self.tick"),
    "goes on at an update": ("Mux(self.update, 0, self.before)", "self.before"),
    "a tick with the update is lost": (
        "before.eq(self.age + (self.tick &",
        "before.eq(self.age + (self.tick & ~self.update &",
    ),
}


@pytest.mark.parametrize("name", MUTANTS)
def test_mutants_are_caught(name: str) -> None:
    with mutant(update_age.UpdateAge, *MUTANTS[name]), caught():
        check()
