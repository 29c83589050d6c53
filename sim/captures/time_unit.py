"""The unit of a column of times is in its name, or in the line below it, or is given."""

import re
from typing import NamedTuple

from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import TIME, parse_frequency, plain_unit

_WORDS = {
    "s": "s sec secs second seconds",
    "ms": "ms msec msecs milli millis millisec millisecond milliseconds",
    "us": "us usec usecs micro micros microsec microsecond microseconds",
    "ns": "ns nsec nsecs nano nanos nanosec nanosecond nanoseconds",
    "ps": "ps picosecond picoseconds",
    "min": "min minute minutes",
    "ticks": "tick ticks clock clocks cycle cycles sample samples sequence",
}
_UNIT_OF = {word: unit for unit, words in _WORDS.items() for word in words.split()}
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9, "ps": 1e12, "min": 1 / 60, "ticks": 0.0}
# Names that a column of times has, without its unit, in the order in which they are looked for.
_NAMES = ("time", "timestamp", "timestamps", "t", "x-axis", "")


class TimeUnit(NamedTuple):
    """Holds a unit of time, or the rate of what counts."""

    name: str
    per_second: float


def unit_named(word: str) -> TimeUnit | None:
    """Return the unit that is called so; one of ticks has no rate, 0."""
    unit = _UNIT_OF.get(plain_unit(word.strip().casefold().removesuffix(".")))
    return None if unit is None else TimeUnit(unit, _PER_SECOND[unit])


def parse_time_unit(what: str, text: str) -> TimeUnit:
    """Read `ms`, or the rate of a counter such as `16MHz`; ParameterError if it is neither."""
    unit = unit_named(text)
    if unit is not None and unit.per_second:
        return unit
    try:
        return TimeUnit("ticks", float(parse_frequency(what, text)))
    except ParameterError:
        units = f"one of {', '.join(TIME)}, or the rate of what counts the time, such as 16MHz"
        raise ParameterError(what, f"must be {units}, not {text!r}") from None


def parted(name: str) -> tuple[str, str]:
    """Return the name of a column without its unit, and the unit: behind it in brackets, or its ending."""
    name = name.strip()
    if match := re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", name):
        return match[1], match[2]
    if (match := re.fullmatch(r"(.*)[_\s./-]([A-Za-zµμ]+)", name)) and unit_named(match[2]):
        return match[1], match[2]
    if match := re.fullmatch(r"(time|t)([mun]s)", name, re.IGNORECASE):
        return match[1], match[2]
    return ("", name) if unit_named(name) else (name, "")


def rank(name: str) -> int | None:
    """Return how likely a column is that of the times, the least being the likeliest; None: it is not."""
    base, unit = parted(name)
    if not base and (not unit or unit.casefold() in ("clock", "clocks", "cycle", "cycles")):  # may be a channel
        return None
    return _NAMES.index(base.casefold()) if base.casefold() in _NAMES else None
