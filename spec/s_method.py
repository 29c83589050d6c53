"""The S method of Tsuji 2009, Sec. V."""

from dataclasses import dataclass
from typing import Any

from tachometry.spec.reciprocal import Reciprocal
from tachometry.spec.tachometer import TachometerSpec, signed_width


@dataclass(frozen=True, kw_only=True)
class STachometer(TachometerSpec):
    """S-method tachometer: averages in step with the alterations of the pulse number.

    Velocity is eq. (21) of Tsuji 2009, or eq. (17) without cancelling, in counts per tick, correctly rounded.

    Parameters
    ----------
    cancel : bool
        Cancel alternate pulse alterations: eq. (21) instead of eq. (17).

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    cancel: bool = True

    method = "s"

    @property
    def kept_ticks(self) -> int:
        """Ticks of the window that a forced update leaves open: its newer half."""
        return self.timing.max_ticks // 2

    @property
    def max_numerator(self) -> int:
        """Largest |N| of ω = b + N/(2·m_s), N = d0 + d1 (eq. 21), or ω = b + N/m_s, N = d1 (eq. 17)."""
        return (4 if self.cancel else 2) * self.max_count

    @property
    def reciprocal(self) -> Reciprocal:
        """The reciprocal of m_s."""
        return Reciprocal(self.timing.max_ticks, self.max_numerator, self.frac_bits, halvings=int(self.cancel))

    @property
    def numerator_width(self) -> int:
        """Bits of N, signed: as many additions does the product N·q take."""
        return signed_width(self.max_numerator)

    @property
    def serial(self) -> bool:
        """Whether ticks are far enough apart for one adder to form the product bit by bit."""
        return self.timing.tick_cycles >= self.tick_to_velocity

    @property
    def tick_to_velocity(self) -> int:
        """One clock for the table, one for its register, one a bit of N, one to add b."""
        return self.numerator_width + 3

    @property
    def parameters(self) -> dict[str, Any]:
        return super().parameters | {"cancel": self.cancel}
