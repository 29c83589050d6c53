"""Sensors as their data sheets draw them: where on the circle of a period each line is high, and what pulses mean."""

import itertools
from functools import cache

Levels = tuple[int, ...]

# Degrees of a period at which a line rises; it stays high for half of the period.
RISES = {"quadrature": {"a": 0, "b": 90}, "hall": {"a": 0, "b": 120, "c": 240}}


def levels_at(sensor: str, degrees: float) -> Levels:
    """Return levels of the lines at a place in the period."""
    return tuple(int((degrees - rise) % 360 < 180) for rise in RISES[sensor].values())


@cache
def middle_of(sensor: str, levels: Levels) -> float | None:
    """Return the middle of where the lines have these levels, None if they never have."""
    found = [degrees + 0.5 for degrees in range(360) if levels_at(sensor, degrees + 0.5) == levels]
    if not found:
        return None
    if found[0] < 1 and found[-1] > 359:  # it is where the period begins anew
        found = [degrees - 360 * (degrees > 180) for degrees in found]
    return sum(found) / len(found)


def count_of(sensor: str, decoding: int, before: Levels, after: Levels) -> tuple[int, bool]:
    """Return −1, 0 or +1, and whether the change is wrong; None of the levels is one that there cannot be."""
    rises = [not old and new for old, new in zip(before, after, strict=True)]
    if sensor == "pulses":
        return int(rises[0] if decoding == 1 else before != after), False
    if sensor == "step-dir":
        steps = rises[0] if decoding == 1 else before[0] != after[0]
        return (0, False) if not steps else (1 if after[1] else -1, before[1] != after[1])
    if sensor == "up-down":
        return int(rises[0]) - int(rises[1]), all(rises)
    old, new = middle_of(sensor, before), middle_of(sensor, after)
    assert old is not None
    assert new is not None
    turn = (new - old + 180) % 360 - 180
    if abs(turn) > (90 if sensor == "quadrature" else 60):
        return 0, True
    if decoding < 4 and before[0] == after[0]:
        return 0, False
    if decoding == 1 and after[1]:
        return 0, False
    return (turn > 0) - (turn < 0), False


@cache
def possible(sensor: str, lines: int) -> list[Levels]:
    """Return all levels that the lines can have."""
    every = list(itertools.product((0, 1), repeat=lines))
    return [levels for levels in every if sensor not in RISES or middle_of(sensor, levels) is not None]


class Decoder:
    """A decoder as a program that is told the levels of each clock."""

    def __init__(self, sensor: str, decoding: int, *, reverse: bool = False) -> None:
        self.sensor, self.decoding, self.sign = sensor, decoding, -1 if reverse else 1
        self.before: Levels | None = None
        self.lost = False

    def see(self, levels: Levels) -> tuple[int, bool]:
        """Return the step of a clock, and whether something is wrong; the first levels are no change."""
        if levels not in possible(self.sensor, len(levels)):
            first, self.lost = not self.lost, True
            return 0, first
        self.lost = False
        step, wrong = (0, False) if self.before is None else count_of(self.sensor, self.decoding, self.before, levels)
        self.before = levels
        return self.sign * step, wrong
