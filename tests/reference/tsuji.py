"""The methods of Tsuji 2009 that sum pulse numbers, by their equations; and what an update is."""

from dataclasses import dataclass, field
from fractions import Fraction

from reference.front import Tick
from reference.settings import Settings

Bound = Fraction | None  # None: there is none


@dataclass(frozen=True)
class Update:
    """A measurement before it is rounded.

    - `cause`: Clock of the count, or last clock of the period, that it comes from.
    - `speed`: In counts per tick.
    - `known`: Whether the bounds are valid.
    - `others`: Outputs that only this method has.
    """

    cause: int
    speed: Fraction
    interval: int
    forced: bool = False
    lower: Bound = None
    upper: Bound = None
    known: bool = False
    others: dict[str, int] = field(default_factory=dict)


def s_updates(settings: Settings, ticks: list[Tick]) -> list[Update]:
    """Return sec. V: windows from one pulse alteration to the next, eq. (17), or eq. (21) which halves their ends."""
    numbers = {-1: 0} | {i: tick.count for i, tick in enumerate(ticks)}
    found: list[Update] = []
    steady, opened = 0, -1
    for i, tick in enumerate(ticks):
        altered = tick.count not in (numbers[i - 1], steady)
        if not altered:
            steady = tick.count
        length = i - opened
        if not altered and length < settings.max_ticks:
            continue
        # Inside of a window all pulse numbers are the steady one: a million of them need not be summed one by one.
        inside = numbers[i - 1] * (length - 1)
        if settings.flag("cancel", True):
            total = Fraction(numbers[opened] + numbers[i], 2) + inside
        else:
            total = Fraction(inside + numbers[i])
        speed, one = total / length, (1 + settings.edge_error) / length
        found.append(Update(tick.last, speed, length, not altered, speed - one, speed + one, bool(found)))
        opened = i if altered else i - settings.max_ticks // 2
    return found


def m_updates(settings: Settings, ticks: list[Tick]) -> list[Update]:
    """Compute eq. (6): the mean pulse number of the last n ticks, those before reset being empty."""
    found, n, off = [], settings.average, 1 + settings.edge_error
    for i, tick in enumerate(ticks):
        total = sum(each.count for each in ticks[max(0, i - n + 1) : i + 1])
        lower, upper = (total - off) / n, (total + off) / n
        found.append(Update(tick.last, Fraction(total, n), n, False, lower, upper, i >= n))
    return found
