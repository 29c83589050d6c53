"""The position compare against its rules, clock by clock, and from the pins alone; see `extras.harness`."""

from fractions import Fraction

import numpy as np
import pytest
from extras.harness import Case, agreeing, in_icarus, on_a_bus
from support.nightly import only
from support.simulate import clock_by_clock

from tachometry.hdl.extras.position_compare import FineGates, Gates
from tachometry.spec.core.extras.position_compare import Compare
from tachometry.spec.formats.carrying import Carrying
from tachometry.spec.formats.velocity_output import VelocityOutput

_TRACK = "position-fine-bits=3 multiplier=block tick=400clk max-time=1600clk position-width=8 preset=3"
CORES = (
    Case("s", "position-compare=list:3:2clk position-width=8", edges=100),
    Case("m", "position-compare=-20:7:0:1clk:both tick=6clk position-width=8 preset=100 index=yes index-reset=yes"),
    Case("m", "position-compare=-90:3:50:2clk:both tick=6clk position-width=8", late=True),
    Case("track", f"position-compare=1.5:0.25:40:1clk:fine {_TRACK}", edges=6, clocks=16_000, seed=5),
)
BUS = Case("s", "position-compare=list:4:3clk position-width=8", seed=4, swings=True)
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
    seen = clock_by_clock(Gates(compare, clocks, WIDTH), rows, names)
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
    seen = clock_by_clock(Gates(compare, 1, WIDTH, aims=True), [*rows, {"step": 0}], SEEN)
    assert [row["position_compare_position"] for row in seen if row["position_compare_valid"]] == wanted
    assert len({*wanted}) > 1


CARRYING = Carrying(
    VelocityOutput(Fraction(1, 10), 200, 12), 1, position_fine_bits=2, more_bits=2, late=12, slope=Fraction(1)
)
SPACING = CARRYING.latency + 4
HALF = 1 << 8  # the place that is carried on wraps there


def wrapped(value: int, half: int) -> int:
    return (value + half) % (2 * half) - half


FINE = ["1.25:2.5:0:3clk:fine", "-3:0.75:30:3clk:backward:fine"]


@pytest.mark.parametrize("asked", FINE)
def test_pulses_between_counts_are_as_the_rules_say(asked: str) -> None:
    """Play updates whose places follow from each other more or less, with jumps now and then."""
    compare = Compare.parse("position_compare", asked)
    rng = np.random.default_rng(1)
    rows, fine, velocity = [], 0, 0
    for clock in range(3000):
        if valid := int(clock % SPACING == 10):
            velocity = int(rng.integers(-100, 101)) if rng.random() < 0.5 else velocity
            fine = wrapped(fine + SPACING * velocity // 20 + int(rng.integers(-3, 4)), HALF >> 2)
        row = {"native_valid": valid, "native_velocity": velocity, "native_position_fine": fine}
        rows.append(row | {"moves": int(rng.random() < 0.005), "tick": int(clock % SPACING == 5)})
    box = FineGates(compare, 3, WIDTH, CARRYING, 8)
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
        of_update = of_tick if row["native_valid"] else of_update
        beyond = wrapped((place >> 2) - awaited, HALF >> 2)
        ahead = beyond < 0 if sign > 0 else beyond >= 0
        if armed and not ahead and (not compare.count or len(begun) < compare.count):
            begun.append(clock + 1)
            wanted |= {"position_compare_position": awaited, "position_compare_count": len(begun)}
            awaited = wrapped(awaited + apart, HALF >> 2)
        armed = armed or ahead
        place = wrapped(place + turn, HALF)
        update = clock + 1 - CARRYING.latency
        if update >= 0 and rows[update]["native_valid"]:  # it is the place from the next clock on
            turn = CARRYING.per_clock.scaled(2 * rows[update]["native_velocity"])
            place = wrapped((rows[update]["native_position_fine"] << 2) + 8 * turn * CARRYING.adds, HALF)
            armed = armed and not of_update
    assert len(begun) == compare.count or len(begun) > 20


def rule(case: Case) -> None:
    """A pulse begins when the shaft passes the edge below its position, whichever way."""
    spec, pulses = case.spec, case.run().tables["position_compare_valid"]
    assert len({*pulses.position_compare_position.tolist()}) > 5
    if spec.preset is not None:
        return
    place = np.cumsum(case.steps())
    after = pulses.clock - spec.latency_entries["pin_to_position_compare"]
    sides = (place[[after - 1, after]] - pulses.position_compare_position) % 256
    assert [*map(set, sides.T.tolist())] == [{255, 0}] * len(pulses)


test_cores = agreeing(CORES, rule)
test_bus = on_a_bus(BUS)
test_verilog = in_icarus(CORES[0])
