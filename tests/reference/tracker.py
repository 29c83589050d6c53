"""The tracking recursion in floating point, as the method is described: least squares over a memory that finds itself.

Places are in counts, times in clocks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

Count = tuple[int, int]  # clock, and ±1


def clip(number: float, limit: float) -> float:
    return max(-limit, min(number, limit))


@dataclass
class Tracker:
    """The state, which sits at an event: the counts of a tick at their mean time.

    - `most_memory`, `forget`, `max_time`, `lead`: Longest memory; silence after which the state is forgotten, and after
      which 0 is shown; how long after a tick its velocity is shown.
    """

    most_memory: float
    forget: float
    max_time: float
    lead: float
    noise: float = 1 / 4
    offsets: list[float] = field(default_factory=lambda: [0.0] * 4)
    events: int = 0
    phase: int = 0  # at rest, one event, more
    p: float = 0
    v: float = 0
    a: float = 0
    at: float = 0
    lost: float = 0  # counts that may still be missing, once a slip is confirmed
    share: float = 1 / 4  # of the latest event in the memory
    shown: tuple[float, float] = (0, 0)  # velocity and acceleration of order two, or of order one
    position: int = 0
    last: int = 0

    def tick(self, end: int, counts: Sequence[Count]) -> float:
        """Return the velocity that is shown of a tick with these counts."""
        places, kinds = [], []
        for _, step in counts:
            lower = self.position + min(step, 0)
            self.position += step
            places.append(lower + 1 / 2)
            kinds.append(lower % 4)
        if counts:
            n = len(counts)
            self.last = counts[-1][0]
            right = sum(place - self.offsets[kind] for place, kind in zip(places, kinds, strict=True)) / n
            self._event(n, sum(places) / n, right, sum(clock for clock, _ in counts) / n, kinds[-1])
        silence = end - self.last
        if silence >= self.forget:
            self.phase = 0
        if self.phase < 2 or silence >= self.max_time:
            return 0
        velocity, slope = self.shown
        shown = velocity + slope * (end + self.lead - self.at)
        return shown if counts else self._bounded(shown, end, silence)

    def _event(self, n: int, raw: float, c: float, t: float, kind: int) -> None:
        if self.phase == 0:
            self.p, self.v, self.a, self.at, self.edge, self.slips = c, 0, 0, t, raw, 0
            self.phase = 1
            return
        dt = max(t - self.at, 1)
        h = self.a * dt
        way = (self.v + h / 2) * dt
        e = c - self.p - way
        if self.phase == 1:
            self._begin(n, raw, c, t, dt)
            return
        if raw == self.edge and abs(way) < 1 / 4:
            return
        self.edge = raw
        if abs(e) > n + 1 / 2 + (2 * self.sure if self.share >= 1 / 8 else 0):
            self.slips += 1
            if self.slips < 3 and 4 * dt <= self.memory:
                self.p, self.at = c, t
            else:
                self._begin(n, raw, c, t, dt)
            return
        if self.slips > 0 and abs(e) <= self.alarm:
            self.lost = 4
        self.slips = 0
        share, more = self._remember(e, dt)
        way, e = way + more, e - more
        rate = min(1 / self.memory, 1 / (4 * dt))
        e1 = e * share / (1 + share) / (1 + 2 * share)
        e2, e3 = e1 * share, e1 * share**2
        self._learn(n, e, share, kind)
        self.p += way + 9 * e1 - 9 * e2 + 6 * e3
        self.v += h + 18 * rate * (2 * e1 - e2)
        self.a += 60 * rate**2 * e1
        self.at = t
        straight = share <= 1 / 64 and (self.a * self.memory**2) ** 2 <= 4096 * self.expected
        self.shown = (self.v - self.a * self.memory / 2, 0) if straight else (self.v, self.a)

    def _begin(self, n: int, raw: float, c: float, t: float, dt: float) -> None:
        self.v, self.a, self.p, self.at, self.edge = (c - self.p) / dt, 0, c, t, raw
        self.memory = dt / 32 if n > 1 else dt
        self.slow_until = self.before = self.mean = self.lag = 0.0
        self.shown, self.slips, self.phase, self.long = (self.v, 0), 0, 2, False
        self.lost, self.share = 0, 1 / 4
        self.expected = self.noise**2 / 4

    @property
    def sure(self) -> float:
        """The noise; while the memory is long, it is learned from the errors alone."""
        return self.noise * (3 / 2 if self.long else 1)

    @property
    def certain(self) -> float:
        """The noise of alarms, which also an edge has that shares no tick."""
        return max(self.noise * 5 / 4 if self.some and not self.long else self.sure, 1 / 16)

    @property
    def some(self) -> bool:
        return self.share < 1 / 64

    @property
    def alarm(self) -> float:
        return (4 + self.some) * self.certain

    def _remember(self, e: float, dt: float) -> tuple[float, float]:
        """Let the memory grow or fall; the share of the event in it, and how far the place moves at once."""
        growth = 1 / 8 if self.memory < self.slow_until else 1.0
        if self.lag**2 >= 7 / 2 * self.expected:
            growth = -1 / 2
            if self.lag**2 >= 14 * self.expected:
                self.slow_until = 2 * self.memory
            if self.lag**2 >= 56 * self.expected:
                growth = -2
        if 8192 * dt < self.memory:
            growth = min(growth, 0)
        self.memory = max(min(self.memory + growth * min(dt, self.memory), self.most_memory), 1)
        self.mean += (e - self.mean) / 4
        least, more = math.inf, 0.0
        if abs(e) > self.alarm:
            least = 8 * dt
        elif abs(self.mean) > 3 / 2 * self.certain:
            least = 2**5.5 * dt
            if self.long:
                more = e / 2
                self.mean -= math.copysign(self.sure, self.mean)
        if least < math.inf:
            self.memory, self.slow_until = min(self.memory, least), 0
        return min(dt / self.memory, 1 / 4), more

    def _learn(self, n: int, e: float, share: float, kind: int) -> None:
        self.events = min(self.events + 1, 504)
        b = math.floor(math.log2(self.events + 8))
        self.long, self.share = share < 1 / 256, share
        alike = self.long and self.lag**2 < 7 / 2 * self.expected
        change = 3 / 2 * abs(e) if alike else abs(e - self.before)
        self.noise = max(self.noise + 2.0 ** -min(b, 8) * (min(change, 4 * self.noise) - self.noise), 2**-10)
        self.before = e
        self.lag += 3 / 2 * share * (e - self.lag)
        self.expected = self.sure**2 * share
        if n == 1 and share < 1 / 4:
            d = 2.0 ** -max(2, min(b - 2, 7)) * clip(e, 1 / 2)
            self.offsets[kind] += d
            self.offsets = [offset - d / 4 for offset in self.offsets]

    def _bounded(self, shown: float, end: int, silence: int) -> float:
        """Return the speed that a silence allows."""
        velocity, slope = self.shown
        s = end - self.at
        z = self.p + (velocity + slope * s / 2) * s - self.position
        sign = 1 if z >= 0 else -1
        offset = self.offsets[(self.position if z > 0 else self.position - 1) % 4]
        margin = 3 * self.certain + 2 * self.sure
        margin = (min(margin, 3 / 4) if self.share >= 1 / 8 else margin) + self.lost
        beyond = max(sign * (z + offset), 0) - 1 / 2 - margin
        if beyond <= 0:
            return shown
        most = (5 / 8 if beyond > 1 / 2 else 1) / (silence + self.lead)
        return sign * min(sign * shown, most)
