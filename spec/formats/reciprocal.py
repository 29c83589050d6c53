"""The reciprocal that stands in for a divider, and how exact it has to be.

Every estimate has the form b + N/(2^s·m) with integers b, N and 1 ≤ m ≤ max_m. The hardware forms

    raw = b·2^f + ⌊(N·q(m) + E + 2^(k−1)) / 2^k⌋,   q(m) = ⌊2^(f+g)/m⌋,   k = g + s,

which is ⌊2^f·x + ½⌋ for the exact x, ties included, because

- q is short of 2^(f+g)/m by less than 1, so N·q + E is above its exact value by more than −|N| + E ≥ 0 (N > 0) and by
  less than |N| + E (N < 0), where E = max|N|: never below it, above it by less than 2E;
- 2^f·N/(2^s·m) + ½ is a multiple of 1/(2^max(s,1)·m), so anything that is added and is less than that, which is
  2^(k−max(s,1))/m in units of 2^−k, cannot reach the next integer.

Hence 2^(g+s−max(s,1)) ≥ 2·E·max_m is enough. By the same two facts the floor of 2^f·x comes of E instead of
E + 2^(k−1), and its ceiling of 2^k − E.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Reciprocal:
    """Widths and contents of q(m) = ⌊2^(frac_bits+guard_bits)/m⌋.

    Parameters
    ----------
    max_m : int
        Largest divisor.
    max_numerator : int
        E, the largest |N|.
    frac_bits : int
        f, fraction bits of the result.
    halvings : int
        s: the quotient is N/(2^s·m).
    """

    max_m: int
    max_numerator: int
    frac_bits: int
    halvings: int

    @property
    def guard_bits(self) -> int:
        """g, the smallest with 2^(g+s−max(s,1)) ≥ 2·E·max_m."""
        return (2 * self.max_numerator * self.max_m - 1).bit_length() + max(self.halvings, 1) - self.halvings

    @property
    def scale_bits(self) -> int:
        """k = g + s, bits to be dropped from the product."""
        return self.guard_bits + self.halvings

    @property
    def width(self) -> int:
        """Bits of q(m), unsigned; q(1) = 2^(f+g) is the largest."""
        return self.frac_bits + self.guard_bits + 1

    def rounding(self, towards: int = 0) -> int:
        """What is added before the k bits are dropped: to round to the nearest (0), down (−1) or up (1)."""
        if towards > 0:
            return (1 << self.scale_bits) - self.max_numerator
        return self.max_numerator + (0 if towards else 1 << (self.scale_bits - 1))

    @property
    def depth(self) -> int:
        """Entries of the table, a power of two; q(m) is at address m modulo depth."""
        return 1 << (self.max_m - 1).bit_length()

    def value(self, m: int) -> int:
        """q(m) = ⌊2^(f+g)/m⌋ for 1 ≤ m ≤ max_m."""
        return (1 << (self.frac_bits + self.guard_bits)) // m

    @property
    def table(self) -> tuple[int, ...]:
        """Contents by address; addresses that no m reaches hold 0."""
        rows = [0] * self.depth
        for m in range(1, self.max_m + 1):
            rows[m % self.depth] = self.value(m)
        return tuple(rows)
