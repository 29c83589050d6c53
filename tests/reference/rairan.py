"""The method of Rairán 2013, a clock at a time: Table 1, and what docs/concepts/rairan.md makes of it."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from reference.front import Front
from reference.settings import Settings
from reference.tsuji import Bound, Update


def estimate(kind: str, n_ep: int, n_dt: int) -> Fraction:
    """Compute eqs. (2), (6) and (11): the upper end of the speed, the lower one, or their harmonic mean."""
    if n_ep == 0:
        return Fraction(0)
    low = n_dt > 1 or n_ep == 1
    n1 = Fraction(n_ep, n_dt)
    n2 = Fraction(1, n_dt + 1) if low else Fraction(n_ep - 1)
    return {"n1": n1, "n2": n2, "n3": 2 * n1 * n2 / (n1 + n2)}[kind]


@dataclass(frozen=True)
class Lines:
    """Holds the entries of Table 1 after a ts.

    - `c_ep`, `c_dt`, `n_ep1`, `n_dt1`: Cep, Cdt, Nep1, Ndt1.
    - `assigned`: Nep1 or Ndt1 was.
    - `ends`: dt ended.
    """

    c_ep: int
    c_dt: int
    n_ep1: int
    n_dt1: int
    assigned: bool
    ends: bool


def table_1(pulses: Iterable[bool], dt: int, most_ep: float = math.inf, most_dt: float = math.inf) -> Iterator[Lines]:
    """Yield table 1 to the letter, its lines by their numbers; counts of a core that is no paper end at the most."""
    c_ep = c_dt = n_ep1 = clock = 0  # 1 and 2
    n_dt1 = 1
    for lep in pulses:  # 3
        assigned = False
        clock += 1  # 4
        if lep and c_dt != 0:  # 5
            n_dt1, assigned = c_dt, True  # 6
            clock = 0  # 7
        if clock == dt and c_ep != 0:  # 8
            n_ep1, assigned = int(min(c_ep, most_ep)), True  # 9
        if lep:  # 10
            c_ep, c_dt = c_ep + 1, 0  # 11
        ends = clock == dt  # 12
        if ends:
            c_dt, c_ep = int(min(c_dt + 1, most_dt)), 0  # 13
            clock = 0  # 14
        yield Lines(c_ep, c_dt, n_ep1, n_dt1, assigned, ends)  # 15


def table_1_updates(settings: Settings, front: Front) -> tuple[list[Update], list[int]]:
    """Return each assignment of Table 1 is an update; and the ends of dt."""
    pulses = (now in front.steps for now in range(front.n_clocks))
    rows = [*table_1(pulses, settings.tick, settings.max_count, settings.max_ticks)]
    shown, found = (0, 1), []
    for now, row in enumerate(rows):
        if not row.assigned:
            continue
        if not row.ends and (row.n_dt1 > 1 or shown[0] <= 1):
            shown = (1, row.n_dt1)
        elif row.ends and (row.n_ep1 > 1 or shown[1] == 1):
            shown = (row.n_ep1, 1)
        others = {"n_ep1": row.n_ep1, "n_dt1": row.n_dt1}
        found.append(Update(now, estimate(settings.estimate, *shown), shown[1], others=others))
    return found, [now for now, row in enumerate(rows) if row.ends]


def next_k(k: int, falling: bool, n: tuple[int, int], target: Fraction, greatest: int) -> tuple[int, bool]:
    """Return k after a window of dt·2^k that measured Nep1 and Ndt1; and whether it falls to 0."""
    n_ep, n_dt = n
    least = next(n for n in range(1, 10**6) if Fraction(1, 2 * n - 1) <= target)  # eq. (13)
    slow = min(least - 1, math.isqrt(1 << greatest)) + (k > 0)
    if n_dt << k >= slow * n_ep or (falling and n_ep < least):
        return max(0, k - 1), k > 1
    if n_ep < least:
        return min(k + 1, greatest), False
    return (max(0, k - 1) if n_ep >= 2 * least else k), False


@dataclass
class Rairan:
    """The core while it runs."""

    settings: Settings
    found: list[Update] = field(default_factory=list)
    ends: list[int] = field(default_factory=list)
    clock: int = 0
    c_ep: int = 0
    c_dt: int = 0
    sign: int = 0
    k: int = 0
    falling: bool = False
    alone: bool = True  # no count came in the window's first dt but the one that opened it
    n: tuple[int, int] = (0, 1)  # Nep1, Ndt1 of the velocity
    k_of_n: int = 0
    resting: bool = True

    @property
    def dt(self) -> int:
        return self.settings.tick << self.k

    @property
    def most(self) -> int:
        """dt in the maximum time."""
        return self.settings.max_ticks >> self.k

    def open(self, sign: int) -> None:
        """A count opens a window."""
        self.sign, self.clock, self.c_ep, self.c_dt, self.alone, self.resting = sign, 0, 1, 0, True, False

    def show(self, now: int, n: tuple[int, int], *, forced: bool = False, least: Bound = None, spare: int = 0) -> None:
        """An update; `spare` clocks more may be missing in the least time that the window can have taken.

        `least` is 0 if nothing says that the shaft went on at all: then it may have come back by an edge's error.
        """
        t, dt, off = self.settings.tick, self.dt, self.settings.edge_error
        n_ep, n_dt = n
        speed = self.sign * estimate(self.settings.estimate, n_ep, n_dt) / (1 << self.k)
        if n_ep > 1:
            fewest, most, longest, shortest = n_ep - 1, n_ep, dt + 1, dt - 1
        else:
            fewest, most, longest, shortest = 1, 1, (n_dt + 1) * dt + 1, n_dt * dt - 1 - spare
        low: Bound = max(fewest - off, Fraction(0)) * t / longest
        if least is not None:
            low = None if shortest <= 0 and off else -off * t / max(shortest, 1)
        ends: tuple[Bound, Bound] = (low, (most + off) * t / shortest if shortest > 0 else None)
        if self.sign < 0:
            lower, upper = ends
            ends = (None if upper is None else -upper, None if lower is None else -lower)
        others = {"n_ep1": n_ep, "n_dt1": n_dt} | ({"dt_shift": self.k} if self.settings.target else {})
        self.found.append(Update(now, speed, n_dt << self.k, forced, *ends, n_ep > 0, others))
        self.n, self.k_of_n = n, self.k

    def adapt(self) -> None:
        """k of the window that begins, by what the one before it measured."""
        target = self.settings.target
        if target is None:
            return
        self.k, self.falling = next_k(self.k, self.falling, self.n, target, self.settings.greatest_shift)

    def step(self, now: int, count: int) -> None:
        """One clock."""
        self.clock += 1
        if count and self.sign and count != self.sign:
            self.sign = count
            self.show(now, (0, 1))
            self.open(count)
            self.k, self.falling = 0, False
        elif count and self.resting:
            self.open(count)
            self.n, self.k, self.falling = (0, 1), 0, False
        elif count and self.c_dt:
            if self.c_dt > 1 or self.n[0] <= 1:
                least = Fraction(0) if self.c_dt >= self.most else None
                self.show(now, (1, self.c_dt), least=least, spare=0 if self.alone else self.dt)
            self.adapt()
            self.open(count)
        elif self.clock == self.dt:
            self.end(now, count)
        elif count:
            self.c_ep += 1
            self.alone = False

    def end(self, now: int, count: int) -> None:
        """dt ends; a count in this clock comes after it."""
        self.ends.append(now)
        counted, self.clock, self.c_ep = min(self.c_ep, self.settings.max_count << self.k), 0, 0
        before = self.c_dt
        self.c_dt = min(self.c_dt + 1, self.most)
        if counted > 1:
            self.show(now, (counted, 1))
        elif count and counted == 1:
            self.show(now, (1, 1))
        elif counted == 1 and self.n[0] > 1:
            self.show(now, (1, 1), least=Fraction(0))
        elif not count:
            self.quiet(now, before)
        if count and not self.resting:
            self.adapt()
            self.open(count)

    def quiet(self, now: int, before: int) -> None:
        """An end of dt that finds no count: decay, and rest."""
        if self.c_dt == self.most and before < self.most:
            self.show(now, (0, 1), forced=True)
            self.resting = True
            return
        silent = self.c_dt if self.alone else self.c_dt - 1
        slower = self.n[0] > 1 or silent << self.k > self.n[1] << self.k_of_n
        if self.settings.decays and self.n[0] and silent and slower:
            self.show(now, (1, silent), forced=True, least=Fraction(0))


def rairan_updates(settings: Settings, front: Front) -> tuple[list[Update], list[int]]:
    """Return all updates, and the ends of all dt."""
    if settings.paper_exact:
        return table_1_updates(settings, front)
    core = Rairan(settings)
    for now in range(front.n_clocks):
        core.step(now, front.steps.get(now, 0))
    return core.found, core.ends
