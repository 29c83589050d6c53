"""The reciprocal that stands in for a divider, and how exact it has to be.

Every estimate has the form b + N/(2^s·m) with integers b, |N| ≤ E and 1 ≤ m ≤ max_m. The hardware forms

    raw = b·2^f + ⌊(N·q(m) + C) / 2^k⌋,   q(m) = 2^k·X + δ,   X = 2^f/(2^s·m),   k = g + s,

which is to be ⌊2^f·x + ½⌋ for the exact x = b + N·X/2^f, ties included. N·X + ½ is a multiple of u = 1/(2^max(s,1)·m).
So the floor is right if what is added to the exact value, N·δ + C − 2^(k−1), is less than u·2^k, and

- more than −u·2^k where N·X + ½ is never a whole number. That is so for max_m < 2^(f+1−s): in N·2^(f+1−s) = m·(odd
  number) the left side has more factors 2 than the right. Then C = 2^(k−1), and |N·δ| < u·2^k is enough;
- at least 0 otherwise: C = 2^(k−1) + c, where c is at least the largest |N·δ|, and both together are less than u·2^k.

With c alone the floor of N·X comes out, by the same facts; its ceiling with C = 2^k − c', where c' is greater than the
largest |N·δ|, and both together are at most 2^k/(2^s·m).

The scalers take N in digits of radix 4, D of them, and shift the sum by 2 bits before they add the product of a digit.
What they shift in is constant, so that c is free where it has the same two bits in every digit: c = 2·(4^D − 1)/3,
which is at least E, since E ≤ 4^D/2.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import count

from tachometry.spec.language.units import signed_width

# Up to this many m are tried.
_MAX_TRIED = 2048

# Bits of the longest sum that one adder forms.
_LONG_SUM = 40


@dataclass(frozen=True)
class Reciprocal:
    """Finds widths and contents of q(m), here 2^(frac_bits+guard_bits)/m rounded to the nearest, so that |δ| ≤ ½."""

    max_m: int  # largest divisor
    max_numerator: int  # e, the largest |N|
    frac_bits: int  # f, fraction bits of the result
    halvings: int  # s: the quotient is N/(2^s·m)
    bounds: bool = False  # quotients are also rounded down and up

    @property
    def off(self) -> int:
        """Twice the largest |N·δ|."""
        return self.max_numerator

    @property
    def digits(self) -> int:
        """D, digits of radix 4 of which N is the sum."""
        return (signed_width(self.max_numerator) + 1) // 2

    @property
    def has_ties(self) -> bool:
        """Whether some N/(2^s·m) lies in the middle between two numbers of the format."""
        return self.max_m >= 1 << max(self.frac_bits + 1 - self.halvings, 0)

    @property
    def slack(self) -> int:
        """c, if it is needed."""
        return 2 * ((1 << 2 * self.digits) - 1) // 3 if self.bounds or self.has_ties else 0

    @property
    def slack_up(self) -> int:
        """c' for the ceiling: its C has the low bits that c has."""
        digits = 1 << 2 * self.digits
        return next(less for less in count(-self.slack % digits, digits) if 2 * less > self.off)

    @property
    def guard_bits(self) -> int:
        """g, the fewest with which all quotients come out right."""
        needed = [(2 * self.slack + self.off) << max(self.halvings, 1)]
        if self.bounds:
            needed.append((2 * self.slack_up + self.off) << self.halvings)
        scale = max(max(needed) * self.max_m // 2, 1 << 2 * self.digits).bit_length()
        return scale - self.halvings

    @property
    def scale_bits(self) -> int:
        """k = g + s, bits to be dropped from the product."""
        return self.guard_bits + self.halvings

    @property
    def width(self) -> int:
        """Bits of q(m), unsigned; q(1) is the largest."""
        return self.value(1).bit_length()

    def rounding(self, towards: int = 0) -> int:
        """Return C, what is added before the k bits are dropped: to round to the nearest (0), down (−1) or up (1)."""
        if towards > 0:
            return (1 << self.scale_bits) - self.slack_up
        return self.slack + (0 if towards else 1 << (self.scale_bits - 1))

    @property
    def is_odd(self) -> bool:
        """Whether every q(m) is odd, so that −q is q with all bits but the last inverted, and nothing is carried."""
        return False

    def is_wide(self, result_width: int) -> bool:
        """Return whether the sum for a result of this width takes two adders: the carries of one limit the clock.

        They need an odd q, because the carry of −q would need a place of its own.
        """
        return self.is_odd and result_width + self.scale_bits > _LONG_SUM

    @property
    def depth(self) -> int:
        """Entries of the table, a power of two; q(m) is at address m modulo depth."""
        return 1 << (self.max_m - 1).bit_length()

    def value(self, m: int) -> int:
        """Return q(m) for 1 ≤ m ≤ max_m."""
        return ((2 << (self.frac_bits + self.guard_bits)) + m) // (2 * m)

    @property
    def table(self) -> tuple[int, ...]:
        """Contents by address; addresses that no m reaches hold 0."""
        rows = [0] * self.depth
        for m in range(1, self.max_m + 1):
            rows[m % self.depth] = self.value(m)
        return tuple(rows)


@dataclass(frozen=True)
class DividedReciprocal(Reciprocal):
    """q(m) as a divider of one subtraction a bit finds it, whose digits are 1 and −1.

    From 1 = Q·m + R with Q = 0, each step doubles this: Q ← 2Q + 1 and R ← 2R − m if R > 0, else Q ← 2Q − 1 and
    R ← 2R + m. So R stays within 1 − m … m, and after f + g steps Q·m + R = 2^(f+g): q = Q is odd, and |δ| = |R|/m ≤ 1.
    The first step makes Q = 1, and q has f + g bits, since q(1) = 2^(f+g) − 1.
    """

    @property
    def off(self) -> int:
        return 2 * self.max_numerator

    @property
    def guard_bits(self) -> int:
        return _fewest(self) if self.tried else super().guard_bits

    @property
    def tried(self) -> bool:
        """Whether so few m, without ties and bounds, have to come out right that all of them are tried.

        What is tried are the fractions of `NarrowReciprocal`.
        """
        return self.max_m <= _MAX_TRIED and not (self.bounds or self.has_ties)

    @property
    def steps(self) -> int:
        """Doublings, f + g."""
        return self.frac_bits + self.guard_bits

    @property
    def is_odd(self) -> bool:
        return True

    def value(self, m: int) -> int:
        return odd_quotient(self.steps, m)


def odd_quotient(bits: int, m: int) -> int:
    """Return the odd number Q with 2^bits = Q·m + R and −m < R ≤ m."""
    return (((1 << bits) - 1) // (2 * m) << 1) + 1


@dataclass(frozen=True)
class NarrowReciprocal(Reciprocal):
    """The narrowest q(m): the fewest guard bits with which there is a right number for every m.

    Without ties and with C = 2^(k−1), the floor is right for N and −N, N > 0, if q/2^k lies between the middles around
    N·X, divided by N: with p odd,

        p/(2N) < q/2^k < (p + 2)/(2N),   p < 2N·X < p + 2.

    So 2q/2^k has to lie between two fractions, the nearest ones below and above 2X that have an odd numerator and a
    denominator of at most E. Most m have no such fraction near 2X, as there are few; that is what saves guard bits. Of
    all fractions with denominators of at most E, neighbours a/b < c/d have bc − ad = 1, so no two numerators in a row
    are even: the nearest odd one is the first or the second.
    """

    @property
    def guard_bits(self) -> int:
        return _narrowest(self)[0]

    def value(self, m: int) -> int:
        return _narrowest(self)[1][m - 1]


@cache
def _narrowest(form: NarrowReciprocal) -> tuple[int, Sequence[int]]:
    """Return the fewest guard bits, and q(m) for m = 1, 2 …: of all that are right the least."""
    between = _between(form)
    for half in count(2 * form.digits):
        found = [(a << half) // b + 1 for (a, b), _ in between]
        if all(q * d < c << half for q, (_, (c, d)) in zip(found, between, strict=True)):
            return half + 1 - form.halvings, found
    raise AssertionError


@cache
def _fewest(form: DividedReciprocal) -> int:
    """Return the fewest guard bits with which each q(m) lies between its fractions."""
    between = _between(form)
    for half in count(2 * form.digits):
        guard = half + 1 - form.halvings
        found = (odd_quotient(form.frac_bits + guard, m) for m in range(1, form.max_m + 1))
        if all(a << half < q * b and q * d < c << half for q, ((a, b), (c, d)) in zip(found, between, strict=True)):
            return guard
    raise AssertionError


def _between(form: Reciprocal) -> Sequence[tuple[tuple[int, int], tuple[int, int]]]:
    """Return the fractions between which 2q/2^k has to lie, for m = 1, 2 and so on."""
    assert not (form.bounds)
    assert not (form.has_ties)
    scaled = 1 << (form.frac_bits + 1 - form.halvings)
    return [_odd_neighbours(scaled, m, form.max_numerator) for m in range(1, form.max_m + 1)]


def _odd_neighbours(numerator: int, denominator: int, most: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the nearest fractions below and above one, with odd numerators and denominators of at most `most`.

    The one between has an even numerator in its lowest terms, or a greater denominator.
    """
    a, b = numerator // denominator, 1  # at most the fraction
    c, d = a + 1, 1  # above it
    while b + d <= most:
        # Towards the fraction as far as possible: the one below it, then the one above.
        below, above = numerator * b - a * denominator, c * denominator - numerator * d
        steps = min(below // above, (most - b) // d)
        if steps:
            a, b = a + steps * c, b + steps * d
        else:
            steps = min((above - 1) // below, (most - d) // b) if below else (most - d) // b
            c, d = c + steps * a, d + steps * b
    lower, upper = (a, b), (c, d)
    if a % 2 == 0:
        times = (most + d) // b
        lower = times * a - c, times * b - d
    if c % 2 == 0:
        times = (most + b) // d
        upper = times * c - a, times * d - b
    return lower, upper
