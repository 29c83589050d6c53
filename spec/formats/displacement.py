"""Number format of the displacements of edges, which a core adds to distances and places."""

import math
from dataclasses import dataclass
from fractions import Fraction

# What gates give to a datapath: the displacement of the edge of a count, and that of the count before.
DISPLACED = ("displaced", "displaced_before")
MAPPED = "mapped"  # also, a clock earlier: whether there is one
ENTRY_BITS = 8  # of an entry of a table, signed
FINEST = Fraction(1, 256)  # counts: no unit of a table of edges is smaller


@dataclass(frozen=True)
class Displacement:
    """Displacements in a unit of 2^low/per_count counts; an entry of a table is shifted left by `shift`."""

    per_count: int  # LSBs of the distance or place that displacements are added to, in a count
    shift: int = 0
    finest: Fraction = FINEST  # counts: the unit is at least this
    entry_bits: int = ENTRY_BITS  # of an entry, signed
    steepest: int | None = None  # greatest change of an entry from edge to edge; None: any

    @property
    def low(self) -> int:
        """Bits of that distance or place below the unit."""
        return max(0, math.ceil(math.log2(self.per_count * self.finest)))

    @property
    def unit(self) -> Fraction:
        """Counts that an entry of 1 stands for."""
        return Fraction(1 << self.low + self.shift, self.per_count)

    @property
    def width(self) -> int:
        """Bits of a displacement in the unit, signed."""
        return self.entry_bits + self.shift

    @property
    def most(self) -> int:
        """Greatest |displacement| in LSBs of the distance or place."""
        return 1 << self.width - 1 + self.low

    @property
    def most_between(self) -> int:
        """Greatest |difference| of neighbouring edges in LSBs of the distance or place."""
        return 2 * self.most if self.steepest is None else self.steepest << self.shift + self.low
