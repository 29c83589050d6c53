"""The methods that measure times, T and M/T, by the rules of docs/concepts/timed.md, event by event."""

import math
from dataclasses import dataclass, field
from fractions import Fraction

from reference.front import Front, Tick
from reference.settings import Settings
from reference.tsuji import Bound, Update


@dataclass(frozen=True)
class Event:
    """A timer period with a count, or one at whose end a tick ends."""

    period: int
    clock: int
    size: int  # counts
    ends: bool
    empty: bool  # the tick that ends has no count; on the lattice, nor has one in which they cancel


def events_of(settings: Settings, front: Front, ticks: list[Tick]) -> list[Event]:
    """Return all that can matter, in order."""
    if settings.lattice:
        return [Event(i, tick.last, tick.count, True, not tick.count) for i, tick in enumerate(ticks)]
    ends = {tick.last: tick.empty for tick in ticks}
    clocks = sorted({*front.steps, *ends})
    return [Event(c, c, front.steps.get(c, 0), c in ends, ends.get(c, False)) for c in clocks]


def ends_of(distance: int, off: Fraction, time: int, scale: int) -> tuple[Bound, Bound]:
    """Return speeds between which the truth is, for a distance, give or take `off`, between edges that `time` periods
    report.

    Each edge lies within a period before its count, so that the true time is up to one period shorter or longer.
    """

    def end(distance: Fraction, periods: int) -> Bound:
        return distance * scale / periods if periods else None

    least, most = distance - off, distance + off

    return end(least, time + 1 if least >= 0 else time - 1), end(most, time - 1 if most > 0 else time + 1)


@dataclass
class Timed:
    """A core of one of these methods while it runs; `division` is how many clocks a division takes."""

    settings: Settings
    division: int
    clock_of: dict[int, int]  # of the timer periods of the lattice
    found: list[Update] = field(default_factory=list)
    begun: int = -(10**9)  # clock in which the division of the last measurement began
    asked: int = -(10**9)  # and that of what a silence allows
    last: int | None = None  # period of the last count
    last_sign: int = 0
    quiet: int = field(init=False)  # period from which a silence is timed
    opened: int | None = None  # period in which the window was opened
    sum: int = 0  # counts since then

    def __post_init__(self) -> None:
        # Reset stands for a count just before the first one that can be seen: an edge is two clocks on its way.
        self.quiet = -1 if self.settings.lattice else -3

    @property
    def scale(self) -> int:
        """Timer periods of a nominal tick."""
        return self.settings.tick // self.settings.period

    @property
    def limit(self) -> int:
        """Timer periods after which a 0 is forced."""
        return max(self.settings.max_ticks * self.scale, math.ceil(self.division / self.settings.period))

    @property
    def least_time(self) -> int:
        """Timer periods that a window of M/T has to exceed."""
        return max(self.settings.min_time // self.settings.period, math.ceil(self.division / self.settings.period) - 1)

    def clock(self, period: int) -> int:
        return self.clock_of[period] if self.settings.lattice else period

    def show(self, clock: int, speed: Fraction, interval: int, bounds: tuple[Bound, Bound], **more: bool) -> None:
        """An update; what it shows is saturated."""
        most = self.settings.max_count
        beyond = more.pop("beyond", False) or self.nearest(abs(speed)) > most
        speed = max(Fraction(-most), min(Fraction(most), speed))
        forced, known = more.get("forced", False), more.get("known", True)
        others = {"out_of_range": int(beyond)}
        self.found.append(Update(clock, speed, interval, forced, *bounds, known, others))

    def ends_of(self, distance: int, time: int) -> tuple[Bound, Bound]:
        """Return the bounds of a measurement."""
        return ends_of(distance, self.settings.edge_error, time, self.scale)

    def take(self, clock: int) -> None:
        """A measurement takes the divider; what was asked of it before is never shown."""
        if clock - self.asked < self.division and self.found and self.found[-1].cause == self.asked:
            self.found.pop()
        self.begun = clock

    def nearest(self, speed: Fraction) -> Fraction:
        """Return as the native output shows it; how many bits it has below another unit, is not known."""
        if not self.settings.native:
            return speed
        return Fraction(math.floor(speed * 2**self.settings.frac_bits + Fraction(1, 2)), 2**self.settings.frac_bits)

    def silences(self, before: int) -> None:
        """Zeros that are forced in periods before this one."""
        while self.quiet + self.limit < before:
            known = self.quiet >= 0  # the first period after reset was not seen completely
            self.quiet += self.limit
            clock = self.clock(self.quiet)
            if clock - self.begun < self.division and self.found:
                self.found.pop()
            self.take(clock)
            ends = (1 + self.settings.edge_error) * self.scale / self.limit
            self.show(clock, Fraction(0), self.limit, (-ends, ends), forced=True, known=known)
            self.opened = None

    def count(self, event: Event) -> None:
        """A count."""
        sign = 1 if event.size > 0 else -1
        fresh = self.opened is None
        if self.settings.method == "t":
            self._t(event, sign, fresh)
        else:
            self._mt(event, sign, fresh)
        self.last, self.last_sign, self.quiet = event.period, sign, event.period

    def _t(self, event: Event, sign: int, fresh: bool) -> None:
        free = event.clock - self.begun >= self.division
        if abs(event.size) > 1 and free:
            self.take(event.clock)
            self.show(event.clock, Fraction(sign), 1, (None, None), beyond=True, known=False)
        elif free and not fresh and self.last is not None and abs(event.size) == 1:
            time = event.period - self.last
            self.take(event.clock)
            distance = sign if sign == self.last_sign or self.settings.paper_exact else 0
            self.show(event.clock, Fraction(distance * self.scale, time), time, self.ends_of(distance, time))
        self.opened = event.period

    def _mt(self, event: Event, sign: int, fresh: bool) -> None:
        turned = self.last_sign == -sign and not self.settings.paper_exact
        self.sum += event.size - sign * turned  # a reversal meets an edge once more
        late = self.settings.lattice and self.settings.external and event.clock - self.begun < self.division
        if not fresh and self.opened is not None:
            time = event.period - self.opened
            if time <= self.least_time or late:
                return
            self.take(event.clock)
            self.show(event.clock, Fraction(self.sum * self.scale, time), time, self.ends_of(self.sum, time))
        self.opened, self.sum = event.period, 0

    def decay(self, event: Event) -> None:
        """The end of a tick in which no count came: 1½ counts over the silence, if that is nearer to 0."""
        if not self.found or event.clock - max(self.begun, self.asked) <= self.division or self.last is None:
            return
        silence, speed = event.period - self.last, self.found[-1].speed
        self.asked = event.clock
        most = Fraction(3 * self.scale, 2 * silence)
        if self.nearest(most) >= self.nearest(abs(speed)) or self.nearest(most) > self.settings.max_count:
            return
        sign, one = (-1 if speed < 0 else 1), Fraction(self.scale, silence)
        off = self.settings.edge_error
        back = 0 if sign > 0 and self.last_sign > 0 else 1
        forth = 0 if sign < 0 and self.last_sign < 0 else 1
        self.show(event.clock, sign * most, silence, (-(back + off) * one, (forth + off) * one), forced=True)


def timed_updates(settings: Settings, front: Front, ticks: list[Tick], division: int) -> list[Update]:
    """Return all updates of method t or mt."""
    core = Timed(settings, division, {i: tick.last for i, tick in enumerate(ticks)})
    events = events_of(settings, front, ticks)
    for event in events:
        core.silences(event.period)
        if event.size:
            core.count(event)
        elif core.quiet + core.limit == event.period:
            core.silences(event.period + 1)
        elif event.ends and event.empty and settings.decays:
            core.decay(event)
    if not settings.lattice:
        core.silences(front.n_clocks)
    return core.found
