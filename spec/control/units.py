"""Units of a control loop: what an LSB of its numbers is, and how many control ticks an update can stand for."""

import math
from dataclasses import dataclass
from fractions import Fraction

from tachometry.spec.control import form
from tachometry.spec.control.form import ACCELERATION_WIDTH
from tachometry.spec.control.law import Law
from tachometry.spec.core.tachometer import TachometerSpec
from tachometry.spec.language.units import PI

MAX_INTERVAL = 1023  # control ticks: a table has as many entries, and one


def longest_interval(spec: TachometerSpec, period: int) -> int:
    """Return the most control ticks, so many clocks apart, that an update of a core can stand for."""
    ticks = -(-(spec.timing.max_ticks * spec.tick.longest) // period) + 2
    return min((1 << ticks.bit_length()) - 1, MAX_INTERVAL)


@dataclass(frozen=True)
class Units:
    """Says how much an LSB of each number of a loop is; much of it follows from the control period."""

    law: Law
    current_width: int  # bits of `current`
    period: int  # clocks between two control ticks

    @property
    def seconds(self) -> Fraction:
        """T_c, the time between two control ticks."""
        return self.law.tachometer.tick.seconds(self.period)

    @property
    def longest(self) -> int:
        """Most control ticks that an update can stand for; then the velocity that is held is taken as one."""
        return longest_interval(self.law.tachometer, self.period) if self.law.synchronised else 1

    @property
    def rad_per_s(self) -> Fraction:
        """One LSB of the velocity in rad/s."""
        spec = self.law.tachometer
        counts = spec.encoder.counts_per_rev * spec.timing.tick_seconds * spec.scale.per_count
        return 2 * PI / (counts * Fraction(2) ** spec.velocity.frac_bits)

    @property
    def current_frac_bits(self) -> int:
        """One LSB of `current` is 2^−this A."""
        return math.floor(math.log2(((1 << (self.current_width - 1)) - 1) / self.law.current_limit))

    @property
    def amperes(self) -> Fraction:
        """One LSB of `current` in A."""
        return Fraction(2) ** -self.current_frac_bits

    @property
    def acceleration_frac_bits(self) -> int:
        """One LSB of the commanded acceleration is 2^−this rad/s²: twice what the greatest current makes fits."""
        most = 2 * self.law.torque_constant * self.law.current_limit / self.law.inertia
        return math.floor(math.log2(((1 << (ACCELERATION_WIDTH - 1)) - 1) / most))

    @property
    def extra_bits(self) -> int:
        """f: bits of y and of w below an LSB of the velocity."""
        law = self.law
        rates = [rate for rate in (law.observer, law.filter) if rate is not None]
        return form.extra_bits(*(form.ratios(rate, self.seconds, 1)[0] for rate in rates))

    @property
    def fine(self) -> Fraction:
        """One LSB of y and of w in rad/s."""
        return self.rad_per_s / (1 << self.extra_bits)

    @property
    def command_bits(self) -> int:
        """Fraction bits of the commanded velocity, below an LSB of the velocity."""
        return min(self.extra_bits, 8)
