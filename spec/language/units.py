"""Quantities with units, read exactly: `20us`, `48MHz`, `400rad/s`, `5deg`."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from decimal import ROUND_CEILING, ROUND_FLOOR, Decimal, localcontext
from fractions import Fraction
from typing import Any, NamedTuple

from tachometry.spec.language.option import ParameterError

# π to 50 digits: speeds in rad/s are compared with whole counts and scaled by constants of up to 48 bits.
PI = Fraction(314159265358979323846264338327950288419716939937510, 10**50)

# A decimal number and its unit. Exponents beyond three digits would make numbers that fill the memory.
# µ is the sign of either code point, U+00B5 or U+03BC.
_NUMBER, _UNIT = r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)", r"\s*([A-Za-zµμ/%]*)"
QUANTITY = _NUMBER + _UNIT
_QUANTITY = re.compile(rf"{_NUMBER}(?:/([1-9]\d{{0,99}}))?{_UNIT}", re.ASCII)  # or a quotient
_LONGEST = 400  # characters of a number
# Sizes of a number: products of several still are floats.
_LEAST, _GREATEST = Fraction(1, 10**30), Fraction(10**30)


class Unit(NamedTuple):
    """A unit: how many of the first unit of its table it is."""

    size: Fraction = Fraction(1)  # the rational factor
    pi: Fraction | None = None  # a factor of so many π, in units that have one

    @property
    def exact(self) -> Fraction:
        """The whole factor, with π to 50 digits."""
        return self.size if self.pi is None else self.size * self.pi * PI

    def nearest(self, value: Fraction) -> float:
        """Return so many of this unit as a float; what has no π in it is rounded once, so 7us is exactly 7e-6."""
        rational = float(value * self.size)
        return rational if self.pi is None else rational * (math.pi * self.pi.numerator / self.pi.denominator)


Units = Mapping[str, Unit]


def _decimal(**exponents: int) -> dict[str, Unit]:
    return {name: Unit(Fraction(10) ** exponent) for name, exponent in exponents.items()}


CLOCKS = "clk"
PLAIN_HERTZ = 1_000_000  # from here on a number without a unit is no frequency in kHz or MHz
TIME = _decimal(s=0, ms=-3, us=-6, ns=-9)
FREQUENCY = _decimal(Hz=0, kHz=3, MHz=6, GHz=9)
SPEED = {"rad/s": Unit(), "rev/s": Unit(pi=Fraction(2)), "rpm": Unit(pi=Fraction(1, 30))}
ANGLE = {**_decimal(rad=0, mrad=-3), "deg": Unit(pi=Fraction(1, 180))}
DEGREES = {"deg": Unit()}
BANDWIDTH = {"rad/s": Unit(), **{name: Unit(unit.size, Fraction(2)) for name, unit in FREQUENCY.items()}}
FRACTION = {"": Unit(), "%": Unit(Fraction(1, 100))}
PLAIN = {"": Unit()}
VOLTAGE = _decimal(V=0, mV=-3)
CURRENT = _decimal(A=0, mA=-3)
TORQUE_CONSTANT = {"Nm/A": Unit(), "mNm/A": Unit(Fraction(1, 1000))}
TORQUE = _decimal(Nm=0, mNm=-3)


def read_quantity(what: str, text: str, units: Units, default: str = "", also: str = "") -> tuple[Fraction, str]:
    """Return the decimal number in a text, exactly, and its unit.

    - `what`: What the message calls the quantity.
    - `also`: What else may stand there, which the caller reads, for the message.

    It raises ParameterError if the text is not of this form, or the number absurdly large or small.
    """
    number = text.strip()
    match = _QUANTITY.fullmatch(number) if len(number) <= _LONGEST else None
    unit = _in_table(plain_unit(match[3]), units) or default if match else ""
    if match is None or unit not in units:
        names = ", ".join(filter(None, units))
        allowed = f"with {'one of the units' if ',' in names else 'the unit'} {names}"
        if default:
            allowed = f"in {names} (default {default})"
        if "" in units:
            allowed = names and f"or one in {names}"
        typed = [f"{match[1]}{name}" for name in units] if match and not match[3] else []
        hint = f": type {' or '.join(filter(None, (', '.join(typed[:-1]), *typed[-1:])))}" if typed and not also else ""
        raise ParameterError(what, f"{' '.join(filter(None, ('must be a number', allowed, also)))}{hint}, not {text!r}")
    value = Fraction(match[1]) / int(match[2] or 1)
    if value and not _LEAST <= abs(value) <= _GREATEST:
        raise ParameterError(what, f"must be of a size from 1e-30 to 1e30, not {text!r}")
    return value, unit


def is_zero(text: str) -> bool:
    """Return whether a text is the number 0, which needs no unit."""
    return re.fullmatch(r"0+(\.0*)?", text.strip()) is not None


def plain_unit(unit: str) -> str:
    """Return the name of a unit in the tables, such as `us` for `µs`."""
    return re.sub("^[µμ]", "u", unit)


def _in_table(unit: str, units: Units) -> str:
    """Return a unit as its table has it, whatever its case is, but where M would be taken for m, mega for milli."""
    if unit in units:
        return unit
    alike = [
        name for name in units if name.lower() == unit.lower() and (name[:1] != "m" or unit[:1] == "m" or name == "ms")
    ]
    return alike[0] if len(alike) == 1 else unit


def read_exactly(what: str, text: str, units: Units, default: str = "", also: str = "") -> Fraction:
    """Return the quantity in the first of the units, exactly; arguments and errors as of `read_quantity`."""
    value, unit = read_quantity(what, text, units, default, also)
    return value * units[unit].exact


def rounded(value: Fraction | float, *, up: bool, digits: int = 4) -> str:
    """Return a limit to some digits, from above or from below, so that what is told is allowed."""
    exact = Fraction(value)
    with localcontext(prec=digits, rounding=ROUND_CEILING if up else ROUND_FLOOR):
        return f"{float(Decimal(exact.numerator) / exact.denominator):.{digits}g}"


def read_nearest(what: str, text: str, units: Units, default: str = "") -> float:
    """Return the quantity in the first of the units as a float; arguments and errors as of `read_quantity`."""
    value, unit = read_quantity(what, text, units, default)
    return units[unit].nearest(value)


@dataclass(frozen=True, eq=False)
class Quantity:
    """Reads and writes quantities of some units, exactly, for an option."""

    units: Units

    def __call__(self, what: str, text: str) -> Fraction:
        return read_exactly(what, text, self.units)

    def written(self, value: Fraction) -> str:
        """Return the shortest text that is read as this value."""
        texts = ((decimal(value / unit.exact), name) for name, unit in self.units.items())
        exact = [f"{number}{name}" for number, name in texts if number]
        return min(exact, key=len) if exact else f"{value}{next(iter(self.units))}"


def decimal(value: Fraction) -> str:
    """Return a number with all of its digits behind the point; the empty text if they have no end."""
    digits = 0
    while (10**digits) % value.denominator:
        if digits > value.denominator.bit_length():
            return ""
        digits += 1
    whole = f"{int(abs(value) * 10**digits):0{digits + 1}}"
    text = f"{whole[:-digits]}.{whole[-digits:]}" if digits else whole
    return f"-{text}" if value < 0 else text


def written_time(clocks: int, clock_hz: int) -> str:
    """Return a number of clocks as a time, or as clocks if that has no end."""
    seconds = Fraction(clocks, clock_hz)
    return Quantity(TIME).written(seconds) if decimal(seconds) else f"{clocks}{CLOCKS}"


def number_reader(units: Units, default: str = "") -> Callable[[str, str], float]:
    """Return a function that reads a number, plain or with one of the units, as a float, for an option."""

    def read(what: str, text: str) -> float:
        try:
            return float(text)
        except ValueError:
            return read_nearest(what, text, units, default)

    return read


def ratio(unit: str, other: str) -> Fraction | None:
    """Return how many of `unit` one of `other` is, exactly; None if there is no exact ratio."""
    for units in (TIME, FREQUENCY, SPEED, ANGLE):
        if unit in units and other in units and (units[unit].pi is None) == (units[other].pi is None):
            return units[other].exact / units[unit].exact
    return None


class _Frequency:
    """Reads hertz in a text such as `48MHz`, a whole number; a plain number is hertz, if it can be nothing else.

    It raises ParameterError if the text is no frequency, or not a positive whole number of hertz.
    """

    def __call__(self, what: str, text: str | int) -> int:
        plain = re.fullmatch(r"\s*-?\d{1,30}\s*", str(text), re.ASCII) and not 0 < int(text) < PLAIN_HERTZ
        hertz = read_exactly(what, str(text), FREQUENCY, "Hz" if plain else "")
        if hertz.denominator != 1 or hertz <= 0:
            raise ParameterError(what, f"must be a positive whole number of Hz, not {text!r}")
        return int(hertz)

    def written(self, value: int) -> str:
        """Return the shortest text that is read as this value."""
        return Quantity(FREQUENCY).written(Fraction(value))


parse_frequency = _Frequency()
# They read seconds in a text such as `20us`, and rad/s in one such as `200rad/s` or `30Hz`.
parse_time, parse_bandwidth = Quantity(TIME), Quantity(BANDWIDTH)


def format_time(seconds: Fraction) -> str:
    """Return a time as people write it: the largest unit that leaves a number of at least 1."""
    for unit, (size, _) in TIME.items():
        if abs(seconds) >= size:
            return f"{float(seconds / size):.9g}{unit}"
    return f"{float(seconds):.9g}s"


def short_time(seconds: Fraction | float) -> str:
    """Return a time to four digits."""
    return format_time(Fraction(f"{float(seconds):.4g}"))


def next_written_time(clocks: int, clock_hz: int, fits: Callable[[int], bool] = lambda clocks: True) -> str:
    """Return the next time of so many clocks or more that fits, and is written in few digits; else the clocks."""
    written = ((number, written_time(number, clock_hz)) for number in range(clocks, 2 * clocks))
    short = (
        text for number, text in written if len(text) <= len("12.25ms") and not text.endswith(CLOCKS) and fits(number)
    )
    return next(short, f"{clocks}{CLOCKS}")


def plural(number: int, what: str) -> str:
    """Return so many of a thing."""
    return f"{number} {what}{'s' * (number != 1)}"


def ceil_log2(number: Fraction) -> int:
    """Return the least k for which 2^k is at least `number`."""
    k = number.numerator.bit_length() - number.denominator.bit_length()  # off by one at most
    return k + 1 if number > Fraction(2) ** k else k if number > Fraction(2) ** (k - 1) else k - 1


def signed_width(limit: int) -> int:
    """Return bits of a two's complement number that holds -limit … +limit."""
    return limit.bit_length() + 1


class SpeedUnit(NamedTuple):
    """The unit in which commands show speeds; everything else has them in rad/s."""

    name: str  # `rad/s`, `rev/s` or `rpm`

    @property
    def rad_per_s(self) -> float:
        """One of this unit in rad/s."""
        return float(SPEED[self.name].exact)

    def of(self, rad_per_s: Any) -> Any:
        """Return a number or an array in rad/s, in this unit."""
        return rad_per_s / self.rad_per_s

    @property
    def suffix(self) -> str:
        """The ending of the names of columns."""
        return self.name.replace("/", "_")


@dataclass(frozen=True)
class Speed:
    """An angular speed with its unit, kept exactly as it was given."""

    value: Fraction
    unit: str = "rad/s"  # `rad/s`, `rev/s` or `rpm`

    def __post_init__(self) -> None:
        if self.unit not in SPEED:
            raise ParameterError("unit", f"of a speed must be one of {', '.join(SPEED)}, not {self.unit!r}")
        if self.value <= 0:
            raise ParameterError("max_speed", f"must be greater than 0, not {self}")

    @classmethod
    def parse(cls, text: str, default: str = "") -> "Speed":
        """Read `400rad/s`, `50rev/s` or `3000rpm`; `default` is the unit of a plain number."""
        return cls(*read_quantity("max_speed", text, SPEED, default))

    @property
    def rad_per_s(self) -> float:
        """The speed in rad/s."""
        return float(self.value * SPEED[self.unit].exact)

    def counts(self, counts_per_rev: Fraction | int, tick_seconds: Fraction) -> Fraction:
        """Return speed / ω_u, counts per tick, with ω_u = 2π/(P·T_s)."""
        size, pi = SPEED[self.unit]
        turns = size / (2 * PI) if pi is None else size * pi / 2
        return self.value * turns * counts_per_rev * tick_seconds

    def ceil_counts(self, counts_per_rev: Fraction | int, tick_seconds: Fraction) -> int:
        """Return the most counts that one tick can hold at this speed."""
        return math.ceil(self.counts(counts_per_rev, tick_seconds))

    def __str__(self) -> str:
        return f"{decimal(self.value) or self.value}{self.unit}"


def parse_speed(what: str, text: str) -> Speed:
    """Read a speed with its unit, for an option."""
    value, unit = (Fraction(0), "") if is_zero(text) else read_quantity(what, text, SPEED)
    if value <= 0:
        raise ParameterError(what, f"must be greater than 0, not {text}: leave it out for none")
    return Speed(value, unit)
