"""Quantities with units, read exactly: `20us`, `48MHz`, `400rad/s`."""

import math
import re
from dataclasses import dataclass
from fractions import Fraction

_TIME = {"s": Fraction(1), "ms": Fraction(1, 10**3), "us": Fraction(1, 10**6), "ns": Fraction(1, 10**9)}
_FREQUENCY = {"Hz": Fraction(1), "kHz": Fraction(10**3), "MHz": Fraction(10**6), "GHz": Fraction(10**9)}
_SPEED = {"rad/s": (Fraction(1), True), "rev/s": (Fraction(1), False), "rpm": (Fraction(1, 60), False)}
_QUANTITY = re.compile(r"([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d{1,3})?)\s*([A-Za-z/]*)")

# π to 50 digits: speeds in rad/s are compared with whole counts and scaled by constants of up to 48 bits.
PI = Fraction(314159265358979323846264338327950288419716939937510, 10**50)


def ceil_log2(number: Fraction) -> int:
    """The least k for which 2^k is at least `number`."""
    k = number.numerator.bit_length() - number.denominator.bit_length()  # off by one at most
    return k + 1 if number > Fraction(2) ** k else k if number > Fraction(2) ** (k - 1) else k - 1


def _quantity(what: str, text: str, units: dict[str, object]) -> tuple[Fraction, str]:
    match = _QUANTITY.fullmatch(text.strip())
    if match is None or match[2] not in units:
        raise ValueError(f"{what} must be a number with one of the units {', '.join(units)}, not {text!r}")
    return Fraction(match[1]), match[2]


def parse_time(what: str, text: str) -> Fraction:
    """Seconds in a text such as `20us`; `what` names the quantity in the message of the ValueError."""
    value, unit = _quantity(what, text, dict(_TIME))
    return value * _TIME[unit]


def parse_frequency(what: str, text: str | int) -> int:
    """Hertz in a text such as `48MHz`, a whole number.

    Raises
    ------
    ValueError
        If the text is no frequency, or not a positive whole number of hertz.
    """
    value, unit = (Fraction(text), "Hz") if isinstance(text, int) else _quantity(what, text, dict(_FREQUENCY))
    hertz = value * _FREQUENCY[unit]
    if hertz.denominator != 1 or hertz <= 0:
        raise ValueError(f"{what} must be a positive whole number of Hz, not {text!r}")
    return int(hertz)


def parse_bandwidth(what: str, text: str) -> Fraction:
    """rad/s in a text such as `200rad/s` or `30Hz`."""
    value, unit = _quantity(what, text, {"rad/s": 1, **_FREQUENCY})
    return value if unit == "rad/s" else value * _FREQUENCY[unit] * 2 * PI


def format_time(seconds: Fraction) -> str:
    """A time as people write it: the largest unit that leaves a number of at least 1."""
    for unit, size in _TIME.items():
        if seconds >= size:
            return f"{float(seconds / size):.9g}{unit}"
    return f"{float(seconds):.9g}s"


def plural(number: int, what: str) -> str:
    """So many of a thing."""
    return f"{number} {what}{'s' * (number != 1)}"


@dataclass(frozen=True)
class Speed:
    """An angular speed with its unit, kept exactly as it was given.

    Parameters
    ----------
    value : Fraction
    unit : str
        `rad/s`, `rev/s` or `rpm`.
    """

    value: Fraction
    unit: str = "rad/s"

    def __post_init__(self) -> None:
        if self.unit not in _SPEED:
            raise ValueError(f"unit of a speed must be one of {', '.join(_SPEED)}, not {self.unit!r}")
        if self.value <= 0:
            raise ValueError(f"max_speed must be greater than 0, not {self}")

    @classmethod
    def parse(cls, text: str) -> "Speed":
        """Read `400rad/s`, `50rev/s` or `3000rpm`."""
        return cls(*_quantity("max_speed", text, dict(_SPEED)))

    @property
    def rad_per_s(self) -> float:
        """The speed in rad/s."""
        size, radians = _SPEED[self.unit]
        return float(self.value * size * (1 if radians else 2 * PI))

    def ceil_counts(self, counts_per_rev: int, tick_seconds: Fraction) -> int:
        """⌈speed / ω_u⌉: the most counts that one tick can hold at this speed, ω_u = 2π/(P·T_s)."""
        size, radians = _SPEED[self.unit]
        counts = self.value * size * counts_per_rev * tick_seconds
        return math.ceil(counts / (2 * PI) if radians else counts)

    def __str__(self) -> str:
        number = self.value.numerator if self.value.denominator == 1 else float(self.value)
        return f"{number}{self.unit}"
