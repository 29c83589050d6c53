"""dt of Rairán 2013 that follows the speed: dt·2^k, the shortest for which eq. (13) stays within a target."""

from dataclasses import dataclass
from fractions import Fraction
from math import isqrt

from tachometry.spec.language.option import ParameterError
from tachometry.spec.language.units import FRACTION, read_exactly


def parse_target(what: str, text: str) -> Fraction:
    """Return a fraction such as `0.1%`, `0.001` or `1/8`."""
    try:
        return read_exactly(what, text, FRACTION)
    except ParameterError:
        raise ParameterError(what, f"must be a fraction such as 0.1% or 0.001, not {text!r}") from None


@dataclass(frozen=True)
class AdaptiveDt:
    """Says how a window takes its k from what the one before it measured, see docs/concepts/rairan.md."""

    target: Fraction  # greatest relative error, eq. (13): less than 1/3, which any estimate has
    max_shift: int  # K, the greatest k

    @property
    def fewest(self) -> int:
        """The least Nep1 within the target: 1/(2·Nep1 − 1), eq. (13)."""
        least = (1 / self.target + 1) / 2
        return -(-least.numerator // least.denominator)

    @property
    def slow(self) -> int:
        """The least Ndt1 for which dt is as short as it can be, k = 0.

        Its error 1/(2·Ndt1 + 1) is within the target. Where no k reaches the target, the error is as small as that of
        Nep1 = 2^K/Ndt1.
        """
        return min(self.fewest - 1, isqrt(1 << self.max_shift))

    def slow_from(self, shift: int) -> int:
        """Return the least Ndt1 at which k is reduced or stays 0: a count takes `slow` dt, or one more if k > 0."""
        return -(-(self.slow + (shift > 0)) >> shift)

    def rare_to(self, shift: int) -> int:
        """Return the greatest Nep1 at which k is reduced because the counts are so far apart."""
        return (1 << shift) // (self.slow + 1)
