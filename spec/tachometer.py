"""What every method shares: front end, ports, latencies, manifest."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from tachometry.spec.encoder import Encoder
from tachometry.spec.timing import Timing
from tachometry.spec.units import Speed


def signed_width(limit: int) -> int:
    """Bits of a two's complement number that holds -limit … +limit."""
    return limit.bit_length() + 1


@dataclass(frozen=True)
class Port:
    """A scalar port of the exported core; `direction` is `input` or `output`."""

    name: str
    direction: str
    width: int = 1
    signed: bool = False


@dataclass(frozen=True, kw_only=True)
class TachometerSpec:
    """From encoder pins to velocity, whatever the method.

    Parameters
    ----------
    encoder : Encoder
    timing : Timing
    frac_bits : int
        Fraction bits of `velocity`, in counts per tick.
    max_speed : Speed or None
        Greatest speed to be measured. It narrows every number that depends on it; pulses beyond it saturate m_e and
        raise `overflow`. None: as wide as the tick has clocks.
    position_width : int
        Bits of `position`, which wraps.
    filter_clocks : int
        Clocks for which a level must hold to be believed; 0 for no filter.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    encoder: Encoder
    timing: Timing
    frac_bits: int = 16
    max_speed: Speed | None = None
    position_width: int = 32
    filter_clocks: int = 0

    method: ClassVar[str]
    # The clock after the window completes the sum, the next saturates and registers it.
    tick_latency: ClassVar[int] = 2

    def __post_init__(self) -> None:
        if not 4 <= self.frac_bits <= 24:
            raise ValueError(f"frac_bits must be from 4 to 24, not {self.frac_bits}")
        if not 8 <= self.position_width <= 48:
            raise ValueError(f"position_width must be from 8 to 48, not {self.position_width}")
        if not 0 <= self.filter_clocks <= 255:
            raise ValueError(f"filter_clocks must be from 0 to 255, not {self.filter_clocks}")

    @property
    def pin_to_count(self) -> int:
        """Clocks from the sampling of a level to its step: the two synchroniser flip-flops and the filter."""
        return 2 + self.filter_clocks

    @property
    def max_count(self) -> int:
        """Largest |m_e|: ⌈max_speed/ω_u⌉, at most one count per clock."""
        cycles = self.timing.tick_cycles
        if self.max_speed is None:
            return cycles
        return min(cycles, self.max_speed.ceil_counts(self.encoder.counts_per_rev, self.timing.tick_seconds))

    @property
    def unit_velocity(self) -> float:
        """ω_u = 2π/(P·T_s) in rad/s, one count per tick (Tsuji 2009, Sec. V-A)."""
        return 2 * math.pi / float(self.encoder.counts_per_rev * self.timing.tick_seconds)

    @property
    def rad_per_s_per_lsb(self) -> float:
        """Value of one LSB of `velocity` in rad/s."""
        return self.unit_velocity / (1 << self.frac_bits)

    @property
    def count_width(self) -> int:
        """Bits of `pulse_count`."""
        return signed_width(self.max_count)

    @property
    def velocity_width(self) -> int:
        """Bits of `velocity`: a mean of pulse numbers never exceeds the largest of them."""
        return self.count_width + self.frac_bits

    @property
    def interval_width(self) -> int:
        """Bits of `interval`, unsigned."""
        return self.timing.max_ticks.bit_length()

    @property
    def interval_unit_cycles(self) -> int:
        """Clocks in one unit of `interval`."""
        return self.timing.tick_cycles

    @property
    def tick_to_velocity(self) -> int:
        """Clocks from `tick` to `velocity_valid`."""
        raise NotImplementedError

    @property
    def ports(self) -> tuple[Port, ...]:
        """Ports of the exported core, in order; method-specific ones come last."""
        return (
            Port("clk", "input"),
            Port("rst", "input"),
            Port("a", "input"),
            Port("b", "input"),
            Port("velocity", "output", self.velocity_width, signed=True),
            Port("velocity_valid", "output"),
            Port("interval", "output", self.interval_width),
            Port("forced", "output"),
            Port("tick", "output"),
            Port("pulse_count", "output", self.count_width, signed=True),
            Port("position", "output", self.position_width, signed=True),
            Port("decode_error", "output"),
            Port("overflow", "output"),
            Port("stalled", "output"),
            *([Port("swallowed_edges", "output", 16)] if self.filter_clocks else []),
        )

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        return {
            "method": self.method,
            "pulses_per_rev": self.encoder.pulses_per_rev,
            "decoding": self.encoder.decoding,
            "clock_hz": self.timing.clock_hz,
            "tick_cycles": self.timing.tick_cycles,
            "max_ticks": self.timing.max_ticks,
            "frac_bits": self.frac_bits,
            "max_speed": None if self.max_speed is None else str(self.max_speed),
            "position_width": self.position_width,
            "filter_clocks": self.filter_clocks,
        }

    def seconds(self, clocks: int) -> Fraction:
        """A number of clocks in seconds, exactly."""
        return Fraction(clocks, self.timing.clock_hz)
