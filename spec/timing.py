"""The clock, the sampling period and the longest measurement."""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.units import format_time, parse_frequency, parse_time

MAX_CLOCK_HZ = 10**11
MAX_TICK_CYCLES = 1 << 20
MAX_TICKS = 1 << 20


@dataclass(frozen=True)
class Timing:
    """Clock, tick and maximum measurement time.

    Parameters
    ----------
    clock_hz : int
        Frequency of `clk` in Hz.
    tick_cycles : int
        T, clocks in a sampling period T_s.
    max_ticks : int
        Ticks after which an update is forced (Tsuji 2009, Sec. V-B: 10 ms).

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    clock_hz: int
    tick_cycles: int
    max_ticks: int

    def __post_init__(self) -> None:
        if not 1 <= self.clock_hz <= MAX_CLOCK_HZ:
            raise ValueError(f"clock must be from 1 Hz to 100 GHz, not {float(self.clock_hz):.6g} Hz")
        if not 1 <= self.tick_cycles <= MAX_TICK_CYCLES:
            raise ValueError(f"tick_cycles must be from 1 to {MAX_TICK_CYCLES}, not {self.tick_cycles}")
        if not 2 <= self.max_ticks <= MAX_TICKS:
            raise ValueError(f"max_ticks must be from 2 to {MAX_TICKS}, not {self.max_ticks}")

    @classmethod
    def parse(cls, clock: str | int, tick: str | int, max_time: str | int) -> "Timing":
        """Timing from texts (`48MHz`, `20us`, `10ms`) or whole numbers (Hz, clocks, clocks).

        Raises
        ------
        ValueError
            Also if the tick is not a whole number of clocks, or the maximum time not of ticks: the message names the
            two nearest that are.
        """
        clock_hz = parse_frequency("clock", clock)
        if clock_hz > MAX_CLOCK_HZ:
            return cls(clock_hz, 1, 2)  # which says so
        tick_cycles = whole_clocks("tick", tick, clock_hz)
        max_ticks = _whole(
            "max_time", max_time, Fraction(tick_cycles, clock_hz), "tick", given_in=Fraction(1, clock_hz)
        )
        return cls(clock_hz, tick_cycles, max_ticks)

    @property
    def tick_seconds(self) -> Fraction:
        """T_s in seconds, exactly."""
        return Fraction(self.tick_cycles, self.clock_hz)


def whole_clocks(what: str, given: str | int, clock_hz: int) -> int:
    """A time such as `40us`, or a number of clocks, as a whole number of clocks; ValueError if it is none."""
    return _whole(what, given, Fraction(1, clock_hz), "clock")


def _whole(what: str, given: str | int, period: Fraction, name: str, given_in: Fraction | None = None) -> int:
    """`given`, a time or a number of clocks, as a whole number of periods."""
    number = str(given).strip()
    seconds = int(number) * (given_in or period) if number.isdecimal() else parse_time(what, number)
    if seconds <= 0:
        raise ValueError(f"{what} must be longer than 0, not {given}")
    periods = seconds / period
    if periods.denominator == 1:
        return int(periods)
    below, above = (f"{n} {name}{'s' * (n != 1)} ({format_time(n * period)})" for n in (int(periods), int(periods) + 1))
    nearest = above if periods < 1 else f"{below} and {above}"
    raise ValueError(
        f"{what} must be a whole number of {name}s, not {given} ({float(periods):.9g}); nearest: {nearest}"
    )
