"""The low-pass filter for fluctuating measurement time, eq. (22) of Tsuji 2009, and how exact it has to be.

    y ← u + E·(y − u),   E = e^(−G·m·T) for an update u, m ticks of T after the one before

In units of 2^−k LSB of u the hardware forms d ← round(E'·d) once, d = y − u, or twice where E is a product of two table
entries E' of p bits. With α = 1 − E, least for m = 1:

- a rounding is off by ½ of a unit and dies out by α per update: ½·2^−k/α LSB, with 2^k ≥ 4/α at most ⅛ LSB, ¼ for two;
- E' is off by 2^−(p+1) (an E' of 1 by 2^−p: it reads all ones), which makes at most 2^(w+k−p) units for w bits of u,
  and dies out in the same way: with p = w + k + 1 at most ⅛ LSB;
- the output is rounded: ½ LSB.

So the output is less than one LSB from the exact recursion.
"""

from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cache

# Up to this many intervals E is looked up in one table; beyond, it is the product of two.
MAX_TABLE = 1024
MAX_EXTRA_BITS = 26


@dataclass(frozen=True)
class LowPass:
    """Finds widths and tables of the filter."""

    exponent: Fraction  # G·T: what one tick adds to the exponent
    max_interval: int  # most ticks that an update can stand for; a greater number is treated as this one
    native_width: int  # bits of u, signed

    @property
    def extra_bits(self) -> int:
        """k: bits below the LSB in which the state is kept, the least with 2^k ≥ 4/α for m = 1."""
        least = 1 - _decay(self.exponent)
        k = 2
        while k <= MAX_EXTRA_BITS and least * (1 << k) < 4:
            k += 1
        return k

    @property
    def factor_bits(self) -> int:
        """p: fraction bits of E."""
        return self.native_width + self.extra_bits + 1

    @property
    def low_bits(self) -> int:
        """Bits of m that choose from the first table."""
        bits = self.max_interval.bit_length()
        return bits if self.max_interval < MAX_TABLE else (bits + 1) // 2

    @property
    def tables(self) -> tuple[tuple[int, ...], ...]:
        """E by address, in 2^−p: a table for the low bits of m and, if that is not enough, one for the bits above."""
        every = [(1, min(1 << self.low_bits, self.max_interval + 1))]
        if self.max_interval >= MAX_TABLE:
            every.append((1 << self.low_bits, (self.max_interval >> self.low_bits) + 1))
        return tuple(_table(self.exponent, self.factor_bits, *one) for one in every)

    @property
    def latency(self) -> int:
        """Clocks from an update that finds the filter at rest to the filtered one: two to begin, a clock a bit of each
        factor and one to load it, one to add, one to round.
        """
        return 4 + (1 if self.max_interval < MAX_TABLE else 2) * (self.factor_bits + 2)


@cache
def _table(exponent: Fraction, factor_bits: int, step: int, entries: int) -> tuple[int, ...]:
    one = 1 << factor_bits
    return tuple(min(round(_decay(exponent * k * step) * one), one - 1) for k in range(entries))


def _decay(power: Fraction) -> Fraction:
    """Return e^(−power) to 60 digits."""
    with localcontext() as context:
        context.prec = 70
        return Fraction((-Decimal(power.numerator) / Decimal(power.denominator)).exp())
