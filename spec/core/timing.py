"""The clock, the sampling period and the longest measurement."""

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from tachometry.spec.language.option import REQUIRED, Option, ParameterError, option, parse_whole, read_options
from tachometry.spec.language.units import (
    CLOCKS,
    FREQUENCY,
    TIME,
    Unit,
    format_time,
    parse_frequency,
    parse_time,
    plural,
    read_exactly,
    read_quantity,
    written_time,
)

MAX_CLOCK_HZ = 10**11
MAX_TICK_CYCLES = 1 << 20
MIN_TICKS, MAX_TICKS = 2, 1 << 20


def parse_clocks(what: str, text: str, timing: Mapping[str, Any]) -> int:
    """Return a time as a whole number of clocks, as `whole_clocks` does, for an option."""
    return whole_clocks(what, text, timing["clock_hz"])


def parse_filter(what: str, text: str, timing: Mapping[str, Any]) -> int:
    """Return a time, rounded up to clocks, or clocks with or without their unit, for an option."""
    if re.fullmatch(r"\s*-?\d+\s*", text, re.ASCII):
        return parse_whole(what, text)
    return math.ceil(time_or_clocks(what, text, timing["clock_hz"]) * timing["clock_hz"])


def _tick(what: str, text: str, timing: Mapping[str, Any]) -> int:
    _check_clock(timing["clock_hz"])
    if text.strip().lower().endswith("hz"):
        return _of_frequency(what, text, timing)
    return _check_tick(parse_clocks(what, text, timing), timing["clock_hz"])


def _of_frequency(what: str, text: str, timing: Mapping[str, Any]) -> int:
    _check_clock(timing["clock_hz"])
    hertz = read_exactly(what, text, FREQUENCY)
    if hertz <= 0:
        raise ParameterError(what, f"must be greater than 0, not {text}")
    clock_hz = timing["clock_hz"]
    return _check_tick(_whole(what, text, 1 / hertz, Fraction(1, clock_hz), "clock", instead="--tick "), clock_hz)


def _check_clock(hertz: int) -> None:
    if not 1 <= hertz <= MAX_CLOCK_HZ:
        raise ParameterError("clock", f"must be from 1 Hz to 100 GHz, not {float(hertz):.6g} Hz")


def _check_tick(cycles: int, clock_hz: int) -> int:
    if not 1 <= cycles <= MAX_TICK_CYCLES:
        longest = format_time(Fraction(MAX_TICK_CYCLES, clock_hz))
        raise ParameterError("tick_cycles", f"must be from 1 to {MAX_TICK_CYCLES}, {longest}, not {cycles}")
    return cycles


def _ticks(what: str, text: str, timing: Mapping[str, Any]) -> int:
    clock = Fraction(1, timing["clock_hz"])
    return _whole(
        what, text, time_or_clocks(what, text, timing["clock_hz"]), timing["tick_cycles"] * clock, "tick", MIN_TICKS
    )


def _usual_ticks(what: str, text: str, timing: Mapping[str, Any]) -> int:
    """Return a time in ticks, rounded up, as many as there can be."""
    ticks = parse_time(what, text) * timing["clock_hz"] / timing["tick_cycles"]
    return min(max(math.ceil(ticks), MIN_TICKS), MAX_TICKS)


_CLOCK_HZ = "Clock of the core, in Hz, kHz, MHz or GHz."
_PWM = "Frequency of the PWM, whose period is the tick. It stands in place of --tick."
_DT = "Sampling period of method rairan (instead of --tick)."


@dataclass(frozen=True)
class Timing:
    """Holds clock, tick and maximum measurement time.

    A value out of range raises ParameterError.
    """

    _group = "Timing"
    clock_hz: int = option(REQUIRED, _CLOCK_HZ, text="48MHz", name="clock", metavar="FREQUENCY", parse=parse_frequency)
    tick_cycles: int = option(
        REQUIRED,
        "Sampling period Ts, such as 100us, 10kHz or 960clk. It must be a whole number of clocks.",
        text="20us",
        shown="20us, or as long as the method needs at this clock",
        name="tick",
        metavar="TIME",
        unit="clocks",
        parse_at=_tick,
        tests=("1", "3", "960", "2"),
        few=3,
        also=(
            Option(_PWM, name="pwm", metavar="FREQUENCY", parse_at=_of_frequency),
            Option(_DT, name="dt", metavar="TIME", parse_at=_tick, fits=lambda spec: spec.facts.own_ticks),
        ),
    )
    max_ticks: int = option(
        REQUIRED,
        "Longest measurement; then the velocity goes to 0. A time, or clocks: 960clk; 2 to 2^20 whole ticks.",
        text="10ms",
        shown="10ms, with method track 100ms",
        name="max-time",
        metavar="TIME",
        unit="ticks",
        parse_at=_ticks,
        fit_at=_usual_ticks,
        tests=("2", "500", "3", "4096"),
        few=3,
    )

    def __post_init__(self) -> None:
        _check_clock(self.clock_hz)
        _check_tick(self.tick_cycles, self.clock_hz)
        if not MIN_TICKS <= self.max_ticks <= MAX_TICKS:
            ticks = f"from {MIN_TICKS} to {MAX_TICKS}, {format_time(MAX_TICKS * self.tick_seconds)}"
            raise ParameterError("max_ticks", f"must be {ticks}, not {self.max_ticks}")

    @classmethod
    def parse(
        cls, clock: str | int | None = None, tick: str | int | None = None, max_time: str | int | None = None
    ) -> "Timing":
        """Return timing from texts (`48MHz`, `20us`, `10ms`, `960clk`) or whole numbers (Hz, clocks, clocks); None is
        the default.

        It raises ParameterError also if the tick is not a whole number of clocks, or the maximum time not of ticks: the
        message names the two nearest that are.
        """
        times = {"tick": tick, "max-time": max_time}
        given = {name: f"{value}clk" if isinstance(value, int) else value for name, value in times.items()}
        texts = {"clock": None if clock is None else str(clock), **given}
        return cls(**read_options(cls, {name: text for name, text in texts.items() if text is not None}))

    def time_of(self, ticks: int) -> str:
        """Return so many ticks as a text that is read as them."""
        return written_time(ticks * self.tick_cycles, self.clock_hz)

    @property
    def tick_seconds(self) -> Fraction:
        """T_s in seconds, exactly."""
        return Fraction(self.tick_cycles, self.clock_hz)


def whole_clocks(what: str, given: str, clock_hz: int) -> int:
    """Return a time such as `40us`, or clocks such as `960clk`, as whole clocks; ParameterError if it is none."""
    return _whole(what, given, time_or_clocks(what, given, clock_hz), Fraction(1, clock_hz), "clock")


def time_or_clocks(what: str, given: str, clock_hz: int) -> Fraction:
    """Return a time such as `40us`, or clocks such as `960clk`, in seconds; ParameterError if it is neither."""
    if (number := given.strip()) == "0":
        return Fraction(0)
    if re.fullmatch(r"[\d.]+", number, re.ASCII):
        raise ParameterError(what, f"must have a unit: type {number}us, or {number}clk for clocks, not {number}")
    value, unit = read_quantity(what, given, {**TIME, CLOCKS: Unit()})
    return value / clock_hz if unit == CLOCKS else value * TIME[unit].exact


def _whole(
    what: str, given: str, seconds: Fraction, period: Fraction, name: str, least: int = 1, instead: str = ""
) -> int:
    """Return seconds as a whole number of periods, of which `least` are needed; `instead` is an option that has it."""
    if seconds <= 0:
        raise ParameterError(what, f"must be longer than 0, not {given}")
    periods = seconds / period
    if periods.denominator == 1:
        return int(periods)
    possible = sorted({max(int(periods) + more, least) for more in (0, 1)})
    slow = f", or a clock of {parse_frequency.written(math.ceil(1 / seconds))}" * (name == "clock" and periods < 1)
    typed = (f"{instead}{n}{CLOCKS}" if name == "clock" else plural(n, name) for n in possible)
    nearest = " and ".join(f"{text} ({format_time(n * period)})" for text, n in zip(typed, possible, strict=True))
    raise ParameterError(
        what, f"must be a whole number of {name}s, not {given} ({float(periods):.9g}); nearest: {nearest}{slow}"
    )
