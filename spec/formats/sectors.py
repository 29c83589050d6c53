"""Displacements of edges as a line with a slope for each sector of a turn."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate

SLOPE_BITS = 16  # signed
_FINEST_BITS = 14  # of a slope times the edges of a sector, below a count


@dataclass(frozen=True)
class Sectors:
    """Edge 0 has the value 0, and each next edge that of the one before and the slope of its sector of 2^`bits` edges.

    The last slope is that from the last edge to edge 0. The displacement of an edge is its value, rounded to 2^`fine`,
    and what the edges of its quarter share.
    """

    edges: int
    bits: int
    fine: int
    slopes: tuple[int, ...]
    quarters: tuple[int, ...]  # by the edge modulo 4, in the unit of displacements; empty: they share nothing

    @property
    def values(self) -> tuple[int, ...]:
        """The values of all edges."""
        return tuple(accumulate((self.slopes[edge >> self.bits] for edge in range(self.edges - 1)), initial=0))

    def __len__(self) -> int:
        return len(self.entries)

    @property
    def depth(self) -> int:
        """Slopes in a memory that has them."""
        return 1 << (len(self.slopes) - 1).bit_length()

    @property
    def entries(self) -> tuple[int, ...]:
        """The table as a program writes it: as many slopes as a memory has, then what the edges of quarters share."""
        return *self.slopes, *[0] * (self.depth - len(self.slopes)), *self.quarters

    @property
    def displacements(self) -> tuple[int, ...]:
        """The displacements of all edges."""
        own, half = self.quarters or (0,), 1 << self.fine - 1
        return tuple((value + half >> self.fine) + own[edge % len(own)] for edge, value in enumerate(self.values))

    @property
    def width(self) -> int:
        """Bits of a displacement, signed."""
        most = max(map(abs, self.values)) // (1 << self.fine) + 1 + max(map(abs, self.quarters), default=0)
        return most.bit_length() + 1


@lru_cache(maxsize=8)
def sectors_of(displacement: tuple[float, ...], most: int, unit: float, quarters: bool) -> Sectors:
    """Return the line nearest to displacements in counts (least squares), of at most `most` sectors, but 4 edges each.

    `unit` is that of displacements, in counts. With `quarters`, the edges of a quarter share what is theirs. ValueError
    if a slope does not fit.
    """
    edges, bits, own = len(displacement), max(2, math.ceil(math.log2(len(displacement) / most))), [0.0] * 4
    if quarters:
        mean = math.fsum(displacement) / edges
        own = [math.fsum(displacement[place::4]) / len(displacement[place::4]) - mean for place in range(4)]
    number, fine = -(-edges >> bits), bits + max(0, _FINEST_BITS - math.ceil(-math.log2(unit)))
    lengths = [min(1 << bits, edges - (sector << bits)) for sector in range(number)]
    matrix, right = [[0.0] * number for _ in lengths], [0.0] * number
    for edge, each in enumerate(displacement):
        sector, within = edge >> bits, edge % (1 << bits) / lengths[edge >> bits]
        shares = (sector, 1 - within), ((sector + 1) % number, within)
        for row, share in shares:
            right[row] += share * (each - own[edge % 4])
            for column, other in shares:
                matrix[row][column] += share * other
    knots, scale, total = _solved(matrix, right), (1 << fine) / unit, 0
    slopes = []
    for sector, length in enumerate(lengths):
        change = (knots[(sector + 1) % number] - knots[0]) * scale
        slopes.append(round((change - total) / length))
        total += slopes[-1] * length
    slopes.append(slopes[-1] - total)
    if not max(map(abs, slopes)) < 1 << SLOPE_BITS - 1:
        raise ValueError(f"must have more sectors than {number} of {1 << bits} edges, which would change by 2 counts")
    return Sectors(edges, bits, fine, tuple(slopes), tuple(round(one / unit) for one in own) if quarters else ())


def _solved(matrix: list[list[float]], right: Sequence[float]) -> list[float]:
    """Return the solution of positive definite equations."""
    rows = [[*row, value] for row, value in zip(matrix, right, strict=True)]
    for place, row in enumerate(rows):
        for below in rows[place + 1 :]:
            if share := below[place] / row[place]:
                below[place:] = [one - share * other for one, other in zip(below[place:], row[place:], strict=True)]
    found = [0.0] * len(rows)
    for place in reversed(range(len(rows))):
        row = rows[place]
        known = math.fsum(row[column] * found[column] for column in range(place + 1, len(rows)))
        found[place] = (row[-1] - known) / row[place]
    return found
