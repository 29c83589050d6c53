"""The compare output against its rules, clock by clock."""

import numpy as np
import pytest
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.output import compare_output
from tachometry.sim.encoder.stress import stress
from tachometry.sim.engines.pysim import PySim
from tachometry.sim.studies.lockstep import lockstep
from tachometry.spec import of_texts
from tachometry.spec.core.compare import Compare

SEEN = ["position_compare", "position_compare_valid", "position_compare_position", "position_compare_count"]
CASES = [
    (Compare(2, 3, 0, "4clk"), 4),
    (Compare(-4, 1, 5, "1clk"), 1),
    (Compare(5, 2, 3, "9clk", direction="backward"), 9),
    (Compare(-7, 15, 0, "2clk", direction="backward"), 2),
    (Compare(-3, 2, 0, "2clk", direction="both"), 2),
    (Compare(-3, 3, 4, "1clk", direction="both"), 1),
    (Compare(0, 0, 0, "3clk", direction="both", depth=4), 3),
    (Compare(0, 0, 0, "1clk", direction="backward", depth=2), 1),
]
WIDTH = 5


class Listed:
    """A list of which one position is awaited, and one less than `depth` wait."""

    def __init__(self, compare: Compare) -> None:
        self.compare = compare
        self.waiting, self.awaited = list[int](), list[int]()

    def place(self, step: int) -> int | None:
        """Return the position that is awaited by such a step."""
        return self.awaited[0] if self.awaited else None

    def move(self, row: dict[str, int], reached: bool) -> None:
        """Go through a clock."""
        room = len(self.waiting) < self.compare.depth - 1
        if self.waiting and (reached or not self.awaited):
            self.awaited = [self.waiting.pop(0)]
        elif reached:
            self.awaited = []
        self.waiting += [row["position_compare_next"]] if row["position_compare_append"] and room else []
        if row["position_compare_clear"]:
            self.waiting, self.awaited = [], []


class Computed:
    """Positions that lie equally apart, by their numbers."""

    def __init__(self, compare: Compare) -> None:
        self.compare, self.number, self.both = compare, 0, compare.direction == "both"
        while self.both and (self.number < (compare.count or 99)) and compare.start + self.number * compare.step <= 0:
            self.number += 1

    def place(self, step: int) -> int | None:
        """Return the position that is awaited by such a step."""
        back = self.both and step < 0
        if self.compare.count and self.number == (0 if back else self.compare.count):
            return None
        sign = -1 if self.compare.direction == "backward" else 1
        return (self.compare.start + sign * (self.number - back) * self.compare.step + 16) % 32 - 16

    def move(self, row: dict[str, int], reached: bool) -> None:
        """Go through a clock."""
        self.number += reached * (row["step"] if self.both else 1)


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("seed", only([0], range(5)))  # 900 clocks meet all positions
def test_every_clock_is_as_the_rules_say(case: tuple[Compare, int], seed: int) -> None:
    """Walk to and fro over all positions of five bits, with steps in clocks side by side and far apart."""
    compare, clocks = case
    rng = np.random.default_rng(seed)
    position, way, rows = 0, 1, []
    for _ in range(900):
        way = way if rng.random() < 0.95 else -way
        step = int(way * (rng.random() < 0.6))
        position = (position + step + 16) % 32 - 16
        row = {"step": step, "position": position}
        if compare.depth:
            place = (position + way * int(rng.integers(0, 6)) + 16) % 32 - 16
            row |= {"position_compare_next": place, "position_compare_append": int(rng.random() < 0.3)}
            row |= {"position_compare_clear": int(rng.random() < 0.02)}
        rows.append(row)
    names = [*SEEN, "position_compare_waiting"][: 5 if compare.depth else 4]
    seen = clock_by_clock(compare_output.CompareOutput(compare, clocks, WIDTH), rows, names)
    rule = Listed(compare) if compare.depth else Computed(compare)
    begun = list[int]()
    wanted = dict.fromkeys(names, 0)
    for clock, row in enumerate(rows):
        wanted["position_compare"] = int(bool(begun) and clock - begun[-1] < clocks)
        wanted["position_compare_valid"] = int(bool(begun) and clock == begun[-1])
        if isinstance(rule, Listed):
            wanted["position_compare_waiting"] = len(rule.waiting) + len(rule.awaited)
        assert seen[clock] == wanted, (case, seed, clock)
        down, awaited = row["step"] < 0, rule.place(row["step"])
        edge = (row["position"] + (down and compare.direction == "both") + 16) % 32 - 16
        wrong = {"forward": down, "backward": not down, "both": False}[compare.direction]
        reached = row["step"] != 0 and not wrong and edge == awaited
        if reached and awaited is not None:
            begun.append(clock + 1)
            wanted |= {"position_compare_position": awaited, "position_compare_count": len(begun)}
        rule.move(row, reached)
    assert len(begun) > 5 or (len(begun) == compare.count and compare.direction != "both")


AIMED = [Compare(-3, 2, 0, "1clk", "both"), Compare(-14, 3, 4, "1clk", "both"), Compare(-1, 14, 2, "1clk", "both")]


@pytest.mark.parametrize("compare", AIMED, ids=str)
def test_a_position_that_is_set_moves_what_is_awaited(compare: Compare) -> None:
    """Set the position anywhere, wait for all positions to be gone through, and walk: each that is met has a pulse."""
    rng = np.random.default_rng(5)
    rows, wanted = list[dict[str, int]](), list[int]()
    for _ in range(60):
        place = int(rng.choice([-14, 14, int(rng.integers(-14, 15))]))
        rows += [{"step": 0, "moves": 1}, *({"step": 0, "moves": 0, "position": place} for _ in range(32))]
        for step in map(int, rng.choice([1, 1, 1, 0, -1], 40) * (1 if place < 0 else -1)):
            step *= -14 <= place + step <= 14
            place += step
            number, part = divmod(place + (step < 0) - compare.start, compare.step)
            there = step and not part and (not compare.count or 0 <= number < compare.count)
            wanted += [place + (step < 0)] if there else []
            rows.append({"step": step, "position": place})
    seen = clock_by_clock(compare_output.CompareOutput(compare, 1, WIDTH, aims=True), [*rows, {"step": 0}], SEEN)
    assert [row["position_compare_position"] for row in seen if row["position_compare_valid"]] == wanted
    assert len({*wanted}) > 1


@pytest.mark.parametrize("places", ["-20:7:0:1clk:both", "-90:3:50:2clk:both"])
def test_presets_and_indices_aim_as_in_the_golden_model(places: str) -> None:
    texts = {"ppr": "50", "clock": "1MHz", "tick": "6clk", "max-time": "60clk", "position-width": "8"}
    spec = of_texts("m", texts | {"preset": "100", "index": "yes", "index-reset": "yes", "position-compare": places})
    found = lockstep(spec, stress(spec, 0, 60), PySim())
    assert found.n_mismatches == 0, found.first
    assert len({*found.actual.tables["position_compare_valid"].position_compare_position.tolist()}) > 5
