"""Bounds of the true speed: how far the shaft may have gone beside what was counted, and the numbers for that."""

import math
from fractions import Fraction

from tachometry.spec.core.follows import Follows, S
from tachometry.spec.language.units import signed_width


class Bound(Follows[S]):
    """Finds the numbers of what encloses the true speed."""

    @property
    def edge_error(self) -> Fraction:
        """E in counts, rounded up to eighths."""
        return Fraction(math.ceil(8 * self.spec.edge_error), 8)

    @property
    def error_bits(self) -> int:
        """Fraction bits of a number of counts to which the edge error is added."""
        return self.edge_error.denominator.bit_length() - 1

    @property
    def uncertainty(self) -> Fraction:
        """A shaft may have travelled as many counts more or less than were counted in a window, exclusive."""
        return 1 + self.edge_error

    @property
    def max(self) -> int:
        """Largest bound in counts per tick, rounded up: a window may have missed a count at its ends."""
        return self.spec.widths.max_count + math.ceil(self.uncertainty)

    @property
    def width(self) -> int:
        """Bits of a bound in counts per tick."""
        return signed_width(self.max) + self.spec.widths.native_frac_bits

    @property
    def absent(self) -> int:
        """Magnitude that an absent bound has, in counts per tick: the greatest that fits."""
        return (1 << (self.width - 1)) - 1

    @property
    def shown_absent(self) -> int:
        """Magnitude of an absent bound at the ports: −limit for `velocity_lower`, limit for `velocity_upper`."""
        output = self.spec.scale.output
        return self.absent if output is None else output.limit
