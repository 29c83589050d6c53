"""How a place between counts is carried on from update to update, to the clock in which something follows from it.

The place of the end of a tick is known to a core many clocks later. It catches up: eight times the way of a clock is
added in each of `adds` clocks, so the place is that of the clock in which it is used. From then on the way of a clock
is added in each. A velocity per clock is off by 0.7 LSB at most, which adds up to less than half an LSB of the place
until the next update.
"""

from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.formats.velocity_output import VelocityOutput

FASTER_BITS = 3  # it catches up 2^3 times as fast as the shaft


@dataclass(frozen=True)
class Carrying:
    """Says how a place is carried on."""

    # how the velocity in counts per clock is computed, whose LSB is 2^-(position_fine_bits + more_bits) counts
    per_clock: VelocityOutput
    shift: int  # of the velocity that it takes, to the left
    # fraction bits of the place that is given, and further ones of the place that is carried on
    position_fine_bits: int
    more_bits: int
    # clocks from the end of a tick at the pins to the velocity per clock of its update, and three to use the place
    late: int
    slope: Fraction  # LSB of the acceleration, in counts per clock²
    block: bool = False  # whether the method has a multiplier of the FPGA

    @property
    def adds(self) -> int:
        """Clocks in which it catches up."""
        return -(-self.late // ((1 << FASTER_BITS) - 1))

    @property
    def waits(self) -> int:
        """Clocks before, so that it has then caught up to the clock."""
        return self.adds * ((1 << FASTER_BITS) - 1) - self.late

    @property
    def latency(self) -> int:
        """Clocks from an update to the first in which the place is that of the update."""
        return self.per_clock.serial_latency + self.waits + self.adds + 2
