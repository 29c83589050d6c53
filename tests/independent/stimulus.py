"""Encoder lines for a core: motions of all kinds, glitches, index pulses and ticks, in short time."""

import random
from collections.abc import Iterable
from dataclasses import dataclass, field

from reference.front import CYCLE, Play


@dataclass
class Lines:
    """Holds the changes of the lines, by clock."""

    n_clocks: int
    phase: int = 0  # where the lines stand at first, in the cycle of forward motion
    edges: list[tuple[int, int]] = field(default_factory=list)  # clock, and by how many phases the lines go on
    glitches: list[tuple[int, int, int]] = field(default_factory=list)  # clock, line, clocks
    pulses: list[tuple[int, int, int]] = field(default_factory=list)  # clock, line (2: Z, 3: tick_in), clocks

    def play(self) -> Play:
        """Return the levels of all lines, and how long each lasts."""
        turned, toggles = self.phase, dict[int, list[int]]()
        for clock, line, length in [*self.glitches, *self.pulses]:
            for at in (clock, clock + length):
                toggles.setdefault(at, [0, 0, 0, 0])[line] ^= 1
        edges = dict[int, int]()
        for clock, by in self.edges:
            edges[clock] = edges.get(clock, 0) + by
        flipped, found, before = [0, 0, 0, 0], Play(), 0
        for clock in sorted({*edges, *toggles, self.n_clocks}):
            if clock >= self.n_clocks:
                break
            if clock:
                found.append((clock - before, self._level(turned, flipped)))
            before = clock
            turned += edges.get(clock, 0)
            flipped = [old ^ new for old, new in zip(flipped, toggles.get(clock, flipped[:0] or [0] * 4), strict=True)]
        return [*found, (self.n_clocks - before, self._level(turned, flipped))]

    def _level(self, turned: int, flipped: list[int]) -> tuple[int, int, int, int]:
        a, b = CYCLE[turned % 4]
        return a ^ flipped[0], b ^ flipped[1], flipped[2], flipped[3]


def steady(at: int, gap: float, n: int, sign: int = 1) -> list[tuple[int, int]]:
    """Return so many edges, the gap apart, after a clock."""
    return [(at + round((k + 1) * gap), sign) for k in range(n)]


def motion(
    rng: random.Random, tick: int, until: int, *, least: int = 1, turns: bool = True, within: int = 0, rests: int = 3
) -> list[tuple[int, int]]:
    """Return edges up to a clock: steady stretches at all speeds, jitter, bursts, reversals, dithering and short rests.

    - `least`: Fewest clocks from one edge to the next.
    - `turns`: Whether the direction changes.
    - `within`: Edges only come in so many clocks of a tick, from clock 100 on, one in each tick at most; 0: anywhere.
    - `rests`: Most ticks without an edge.
    """
    found: list[tuple[int, int]] = []
    at, sign = 24, 1

    def go(gap: float) -> None:
        nonlocal at
        at += max(least, round(gap))
        if within:
            nth = max(at // tick, found[-1][0] // tick + 1 if found else 0)
            at = nth * tick + 100 + rng.randrange(within)
        found.append((at, sign))

    while at < until:
        kind = rng.randrange(8)
        gap = tick * rng.choice((0.05, 0.13, 1 / 3, 0.31, 0.5, 0.99, 1, 1.01, 1.5, 2.37, 4))
        if kind < 4:
            start, n = at, rng.randrange(3, 16)
            for k in range(n):
                go(start + (k + 1) * gap - at)
        elif kind == 4:
            for _ in range(rng.randrange(4, 12)):
                go(gap * (1 + 0.3 * rng.gauss(0, 1)))
        elif kind == 5:
            for _ in range(rng.randrange(2, 9)):
                go(1)
        elif kind == 6:
            at += rng.randrange(rests * tick + 1)
        for _ in range(rng.randrange(1, 6) if kind == 7 and turns else 0):
            sign = -sign
            go(gap)
    return found


def external(
    rng: random.Random, nominal: int, until: int, *, least: int, most: int, regular: bool
) -> Iterable[tuple[int, int, int]]:
    """Return rises of an external tick: regular ones, jittered ones, as close and as far apart as may be, and beyond.

    `regular`: at multiples of the nominal tick only, some of which are left out.
    """
    at = nominal - 3 if regular else 7
    while at < until and regular:
        yield at, 3, 1
        at += nominal * rng.choice((1, 1, 1, 1, 2, 3))
    while at < until:
        kind = rng.randrange(12)
        gaps = {0: least, 1: least - 1, 2: most, 3: most + 1, 4: most + nominal // 2, 5: nominal * 3}
        gap = gaps.get(kind, nominal + rng.randrange(-(nominal // 8), nominal // 8 + 1))
        at += max(2, gap)
        yield at, 3, 1
