"""How a place that waits for a count goes to the middle of its count as the velocity falls."""

from dataclasses import dataclass

PLACE_BITS = 8  # bits of the counts between the fine position and the position
_SPEED_BITS = 12  # of a fraction of a count per tick, where two velocities are compared


@dataclass(frozen=True)
class Settling:
    """Formats of places, relative to the position, and of velocities in counts per tick."""

    position_fine_bits: int
    velocity_bits: int  # fraction bits of the velocity

    @property
    def half(self) -> int:
        """Half a count."""
        return 1 << self.position_fine_bits - 1

    @property
    def place_bits(self) -> int:
        """Bits of a place, with its sign."""
        return self.position_fine_bits + PLACE_BITS

    @property
    def speed_shift(self) -> int:
        """Bits of a velocity that do not matter where it is compared with an earlier one."""
        return max(0, self.velocity_bits - _SPEED_BITS)
