"""The velocity in a unit of the outside: rad/s, rev/s or rpm, with an LSB that is a power of two."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import PI, SPEED

NATIVE = "count/tick"
# So many of each unit are one revolution per second.
_PER_REV_PER_SECOND = {name: 2 * PI / unit.exact for name, unit in SPEED.items()}
UNITS = (NATIVE, *_PER_REV_PER_SECOND)


def parse_lsb(what: str, text: str) -> int:
    """Return fraction bits N of an LSB, 2^−N, such as `2^-4` or `0.0625`; ParameterError if it is no power of two."""
    if match := re.fullmatch(r"2\^([+-]?[0-9]{1,3})", text.strip()):
        return -int(match[1])
    if re.fullmatch(r"\+?([0-9]{1,30}(\.[0-9]{0,100})?|\.[0-9]{1,100})", text.strip(), re.ASCII):
        lsb = Fraction(text.strip())
        if lsb.numerator.bit_count() == lsb.denominator.bit_count() == 1:
            return lsb.denominator.bit_length() - lsb.numerator.bit_length()
    raise ParameterError(what, f"must be a power of two such as 2^-10 or 0.0625, not {text!r}")


def per_count(unit: str, counts_per_rev: Fraction | int, tick_seconds: Fraction) -> Fraction:
    """Return one count per tick in `unit`."""
    return Fraction(1) if unit == NATIVE else _PER_REV_PER_SECOND[unit] / (counts_per_rev * tick_seconds)


@dataclass(frozen=True)
class VelocityOutput:
    """velocity = ⌊(v·multiplier + 2^(shift−1)) / 2^shift⌋ of the raw native velocity v, held within ±`limit`.

    One LSB of v is at most a quarter of one of the output and correctly rounded: an error of ⅛. The multiplier is
    rounded where it adds at most 1/16. So the output is off by less than 0.7 LSB.
    """

    ratio: Fraction  # LSBs of the output in one LSB of v, at most ¼; or 1, to hold v within fewer bits
    max_native: int  # largest |v|
    width: int  # bits of the output
    bounds: bool = False  # whether v may be a bound

    @property
    def _constant(self) -> tuple[int, int]:
        """The odd multiplier, and the shift."""
        if self.ratio == 1:
            return 1, 0
        shift = self.max_native.bit_length() + 3
        multiplier = round(self.ratio * (1 << shift))
        zeros = min(shift, (multiplier & -multiplier).bit_length() - 1) if multiplier else shift
        return multiplier >> zeros, shift - zeros

    @property
    def multiplier(self) -> int:
        """The ratio, times 2^shift."""
        return self._constant[0]

    @property
    def shift(self) -> int:
        """Bits of the product that are rounded away."""
        return self._constant[1]

    def rounding(self, towards: int = 0) -> int:
        """Return the constant added before these bits are dropped, to round to the nearest (0), down (−1) or up (1).

        Down and up allow for the greatest error of the rounded multiplier, so that the result is a bound.
        """
        if not towards:
            return 1 << self.shift >> 1
        exact = self.ratio * (1 << self.shift) == self.multiplier
        slack = 0 if exact else 1 << max(self.shift - 4, 0)
        return -slack if towards < 0 else (1 << self.shift) - 1 + slack

    def scaled(self, native: int, towards: int = 0) -> int:
        """Return the output for a raw native velocity, before it is held within the limit."""
        return (native * self.multiplier + self.rounding(towards)) >> self.shift

    @property
    def greatest(self) -> int:
        """The greatest output, which may be that of an upper bound."""
        return self.scaled(self.max_native, int(self.bounds))

    @property
    def limit(self) -> int:
        """The greatest magnitude that is shown."""
        return min(self.greatest, (1 << (self.width - 1)) - 1)

    @property
    def digits(self) -> tuple[tuple[int, int], ...]:
        """The multiplier as a sum of (place, ±1)·2^place with the fewest terms, the lowest place first."""
        return tuple(_canonical(self.multiplier))

    @property
    def serial_latency(self) -> int:
        """Clocks with one adder: one for each bit of the multiplier, and one each to clear, to round and to hold."""
        return self.multiplier.bit_length() + 3

    @property
    def pipelined_latency(self) -> int:
        """Clocks with an adder for every digit but the first: one for each, one to round and one to hold."""
        return len(self.digits) - 1 + (self.shift > 0) + 1


def _canonical(number: int) -> Iterator[tuple[int, int]]:
    place = 0
    while number:
        if number & 1:
            digit = 2 - (number & 3)
            yield place, digit
            number -= digit
        number >>= 1
        place += 1
