"""The reciprocal for long measurements: carried along by subtraction instead of looked up.

With C = 2^(f−s) every estimate is b·2^f + N·C/m in units of 2^−f, N an integer. Of C/m the hardware keeps the exact
quotient and remainder, C = Q·m + R with 0 ≤ R < m, so there are no guard bits:

    raw = b·2^f + N·Q + ⌊N·R/m + ½⌋

which is ⌊2^f·x + ½⌋ for the exact x. From m to m + 1, Q and R are updated by

    C = Q·(m+1) + (R − Q):   (Q, R) ← (Q, R−Q) if R ≥ Q, else (Q−1, R−Q+m+1)

One correction is enough where Q ≤ m + 1, hence for all m ≥ √C. For smaller m a table holds Q and R.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class CarriedReciprocal:
    """Finds widths and contents for Q = ⌊2^(frac_bits−halvings)/m⌋ and its remainder R."""

    max_m: int  # largest divisor
    max_numerator: int  # e, the largest |N|
    frac_bits: int  # f, fraction bits of the result
    halvings: int  # s: the result is b + N/(2^s·m)
    entry: int  # where m goes on when it does not start over at 1

    @property
    def scale(self) -> int:
        """C = 2^(f−s)."""
        return 1 << (self.frac_bits - self.halvings)

    @property
    def depth(self) -> int:
        """Entries of the table: the first power of two that is at least √C."""
        return 1 << (self.frac_bits - self.halvings + 1) // 2

    @property
    def quotient_width(self) -> int:
        """Bits of Q, unsigned; Q = C for m = 1 is the largest."""
        return self.scale.bit_length()

    @property
    def carried_quotient_width(self) -> int:
        """Bits of Q where it is carried."""
        return (self.scale // self.depth).bit_length()

    @property
    def remainder_width(self) -> int:
        """Bits of R, unsigned."""
        return self.max_m.bit_length()

    @property
    def digits(self) -> int:
        """Bits of ⌊N·R/m⌋ without its sign: it is at least −E and less than E."""
        return (self.max_numerator - 1).bit_length()

    @property
    def table_remainder_width(self) -> int:
        """Bits of R in the table."""
        return (self.depth - 1).bit_length()

    @property
    def width(self) -> int:
        """Bits of an entry of the table."""
        return self.quotient_width + self.table_remainder_width

    def value(self, m: int) -> tuple[int, int]:
        """Return (Q, R) for m ≥ 1."""
        return divmod(self.scale, m)

    @property
    def table(self) -> tuple[int, ...]:
        """Contents by address m < depth, Q in the low bits and R above; address 0 is never read."""
        rows = [self.value(m) for m in range(1, self.depth)]
        return (0, *(q | r << self.quotient_width for q, r in rows))

    @property
    def presets(self) -> dict[int, tuple[int, int]]:
        """(Q, R) by the m at which carrying begins: where the table ends, and where m goes on beyond it."""
        return {m: self.value(m) for m in {self.depth, self.entry} if m >= self.depth}
