"""What every method shares: front end, ports, latencies, manifest."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar

from tachometry.spec.encoder import Encoder
from tachometry.spec.formats.low_pass import MAX_EXTRA_BITS, LowPass
from tachometry.spec.formats.velocity_output import NATIVE, UNITS, VelocityOutput, per_count
from tachometry.spec.option import options_of
from tachometry.spec.port import UPDATE, Port, held, ports_of
from tachometry.spec.timing import MAX_TICK_CYCLES, Timing
from tachometry.spec.units import Speed, ceil_log2

MAX_NATIVE_FRAC_BITS = 24
TICK_IN_TO_WINDOW_END = 2  # clocks: the synchroniser
# The ends of what encloses the true speed, and which way each is rounded: outward.
BOUNDS = {"velocity_lower": -1, "velocity_upper": 1}


def signed_width(limit: int) -> int:
    """Bits of a two's complement number that holds -limit … +limit."""
    return limit.bit_length() + 1


@dataclass(frozen=True, kw_only=True)
class TachometerSpec:
    """From encoder pins to velocity, whatever the method.

    Parameters
    ----------
    encoder : Encoder
    timing : Timing
    unit : str
        Of `velocity`: `count/tick`, `rad/s`, `rev/s` or `rpm`.
    frac_bits : int
        One LSB of `velocity` is 2^−frac_bits of its unit.
    velocity_bits : int or None
        Bits of `velocity`, which saturates and raises `velocity_overflow`; None: as many as it can need.
    max_speed : Speed or None
        Greatest speed to be measured. It narrows every number that depends on it; pulses beyond it saturate m_e and
        raise `overflow`. None: as wide as the tick has clocks.
    position_width : int
        Bits of `position`, which wraps.
    filter_clocks : int
        Clocks for which a level must hold to be believed; 0 for no filter.
    index : bool
        A rising index line Z captures the position.
    index_reset : bool
        And sets it to 0.
    max_tick_cycles : int or None
        Ticks come from outside, this many clocks apart at most; the tick of `timing` is their nominal period. None: the
        core makes the ticks.
    age : bool
        Output `age`: ticks since the update.
    bounds : bool
        Outputs `velocity_lower` and `velocity_upper`, which enclose the true mean speed over the measured window, and
        `bounds_valid`.
    lowpass : Fraction or None
        G of the low-pass filter for fluctuating measurement time, eq. (22) of Tsuji 2009, in rad/s; None: no filter.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    encoder: Encoder
    timing: Timing
    unit: str = NATIVE
    frac_bits: int = 16
    velocity_bits: int | None = None
    max_speed: Speed | None = None
    position_width: int = 32
    filter_clocks: int = 0
    index: bool = False
    index_reset: bool = False
    max_tick_cycles: int | None = None
    age: bool = False
    bounds: bool = False
    lowpass: Fraction | None = None

    # Name of the method.
    method: ClassVar[str]
    # Whether the method ends the ticks itself, by what it counts.
    own_ticks: ClassVar[bool] = False
    # Whether there are no more updates once one is `stalled`.
    last_when_stalled: ClassVar[bool] = False
    # The clock after the window completes the sum, the next saturates and registers it.
    tick_latency: ClassVar[int] = 2

    def __post_init__(self) -> None:
        self._check_output()
        if not 8 <= self.position_width <= 48:
            raise ValueError(f"position_width must be from 8 to 48, not {self.position_width}")
        if not 0 <= self.filter_clocks <= 255:
            raise ValueError(f"filter_clocks must be from 0 to 255, not {self.filter_clocks}")
        if self.index_reset and not self.index:
            raise ValueError("index_reset must be given together with an index")
        if self.lowpass is not None and (self.lowpass <= 0 or self.low_pass.extra_bits > MAX_EXTRA_BITS):
            least = float(4 / (self.timing.tick_seconds * (1 << MAX_EXTRA_BITS)))
            raise ValueError(f"lowpass must be at least {least:.4g} rad/s here, not {float(self.lowpass):.9g} rad/s")
        if self.own_ticks and self.max_tick_cycles is not None:
            raise ValueError(f"method must be another than {self.method} for an external tick: it makes its own")
        if self.max_tick_cycles is not None:
            shortest = self.timing.tick_cycles
            if shortest < 2:
                raise ValueError("tick_cycles must be at least 2 with an external tick, not 1")
            if not shortest <= self.max_tick_cycles <= MAX_TICK_CYCLES:
                raise ValueError(
                    f"max_tick_cycles must be from {shortest}, one tick, to {MAX_TICK_CYCLES}, "
                    f"not {self.max_tick_cycles}"
                )

    def _check_output(self) -> None:
        if self.unit not in UNITS:
            raise ValueError(f"unit must be one of {', '.join(UNITS)}, not {self.unit!r}")
        if self.velocity_bits is not None and not 8 <= self.velocity_bits <= 64:
            raise ValueError(f"velocity_bits must be from 8 to 64, not {self.velocity_bits}")
        coarsest, finest = self.frac_bits_range(self.unit)
        if coarsest <= self.frac_bits <= finest:
            return
        if self.unit == NATIVE:
            raise ValueError(f"frac_bits must be from {coarsest} to {finest}, not {self.frac_bits}")
        raise ValueError(
            f"lsb must be from 2^{-finest} to 2^{-coarsest} {self.unit} with this encoder and tick, "
            f"not 2^{-self.frac_bits}"
        )

    def frac_bits_range(self, unit: str) -> tuple[int, int]:
        """Fewest and most fraction bits of the velocity in `unit`."""
        if unit == NATIVE:
            return 4, MAX_NATIVE_FRAC_BITS
        # The greatest speed must be at least one LSB, and one count per tick at most 2^22.
        count = per_count(unit, self.encoder.counts_per_rev, self.timing.tick_seconds)
        return 1 - ceil_log2(count * self.max_count), MAX_NATIVE_FRAC_BITS - 2 - ceil_log2(count)

    @property
    def native_frac_bits(self) -> int:
        """Fraction bits of the velocity in counts per tick, of which one in another unit is made."""
        if self.unit == NATIVE:
            return self.frac_bits
        return max(4, ceil_log2(self._lsb_per_count) + 2)

    @property
    def native_width(self) -> int:
        """Bits of the velocity in counts per tick: a mean of pulse numbers never exceeds the largest of them."""
        return signed_width(self.max_count) + self.native_frac_bits

    @property
    def output(self) -> VelocityOutput | None:
        """How `velocity` is made of the native velocity; None if that is the output."""
        if self.unit == NATIVE and self.velocity_bits is None:
            return None
        native = 1 << self.native_frac_bits
        largest = self.bound_limit if self.bounds else self.max_count * native
        return VelocityOutput(self._lsb_per_count / native, largest, self.velocity_bits, self.bounds)

    @property
    def max_bound(self) -> int:
        """Largest bound in counts per tick, rounded up: a window may have missed a count at its ends."""
        return self.max_count + 1

    @property
    def bound_width(self) -> int:
        """Bits of a bound in counts per tick."""
        return signed_width(self.max_bound) + self.native_frac_bits

    @property
    def bound_limit(self) -> int:
        """Magnitude of a bound in counts per tick that there is none."""
        return (1 << (self.bound_width - 1)) - 1

    @property
    def shown_bound_limit(self) -> int:
        """The same at the ports: `velocity_lower` of −limit and `velocity_upper` of limit are none."""
        return self.bound_limit if self.output is None else self.output.limit

    @property
    def update_spacing(self) -> int:
        """Fewest clocks between two updates."""
        return self.timing.tick_cycles if self.max_tick_cycles is None else self.min_tick_cycles

    @property
    def _lsb_per_count(self) -> Fraction:
        count = per_count(self.unit, self.encoder.counts_per_rev, self.timing.tick_seconds)
        return count * Fraction(2) ** self.frac_bits

    @property
    def low_pass(self) -> LowPass:
        """The low-pass filter, of which there must be one."""
        assert self.lowpass is not None
        # Those that wait for the filter add up, at most a tick in each of its clocks.
        longest = max((1 << self.timing.max_ticks.bit_length()) - 1, 255)
        return LowPass(self.lowpass * self.timing.tick_seconds, longest, self.native_width)

    @property
    def low_pass_latency(self) -> int:
        """Clocks from the velocity as measured to the filtered one, if they are no closer."""
        return 0 if self.lowpass is None else self.low_pass.latency

    @property
    def greatest_speed(self) -> float:
        """Greatest speed, in rad/s, that `velocity` can show; ticks are as long as nominal."""
        counted = self.max_count * self.unit_velocity
        return counted if self.output is None else min(counted, self.output.limit * self.rad_per_s_per_lsb)

    @property
    def rounding_lsb(self) -> float:
        """Most that rounding takes from `velocity` or adds to it, in its LSB."""
        return 0.5 if self.unit == NATIVE else 0.7

    @property
    def longest_tick(self) -> int:
        """Most clocks in a tick."""
        return self.timing.tick_cycles if self.max_tick_cycles is None else self.max_tick_cycles

    @property
    def min_tick_cycles(self) -> int:
        """Fewest clocks between two external ticks: what works step by step must be done."""
        output = self.output_latency if self.output_serial else 0
        return max(2, self.datapath_latency if self.serial else 0, output)

    def has_room(self, clocks: int) -> bool:
        """Whether a tick is long enough for work of so many clocks; external ones may come in half the time."""
        return self.timing.tick_cycles >= (clocks if self.max_tick_cycles is None else 2 * clocks)

    @property
    def pin_to_count(self) -> int:
        """Clocks from the sampling of a level to its step: the two synchroniser flip-flops and the filter."""
        return 2 + self.filter_clocks

    @property
    def max_count(self) -> int:
        """Largest |m_e|: ⌈max_speed/ω_u⌉, for the longest tick, at most one count per clock."""
        cycles = self.longest_tick
        if self.max_speed is None:
            return cycles
        return min(cycles, self.max_speed.ceil_counts(self.encoder.counts_per_rev, self.seconds(cycles)))

    @property
    def unit_velocity(self) -> float:
        """ω_u = 2π/(P·T_s) in rad/s, one count per tick (Tsuji 2009, Sec. V-A)."""
        return 2 * math.pi / float(self.encoder.counts_per_rev * self.timing.tick_seconds)

    @property
    def rad_per_s_per_lsb(self) -> float:
        """Value of one LSB of `velocity` in rad/s."""
        return float(self.unit_velocity / self._lsb_per_count)

    @property
    def max_pulse_count(self) -> int:
        """Largest |m_e| of the longest tick that a method with its own makes, but for a wait for a count."""
        return self.max_count

    @property
    def count_width(self) -> int:
        """Bits of `pulse_count`."""
        return signed_width(self.max_pulse_count)

    @property
    def velocity_width(self) -> int:
        """Bits of `velocity`."""
        return self.native_width if self.output is None else self.output.port_width

    @property
    def interval_width(self) -> int:
        """Bits of `interval`, unsigned."""
        return self.timing.max_ticks.bit_length()

    @property
    def interval_unit_cycles(self) -> int:
        """Clocks in one unit of `interval`."""
        return self.timing.tick_cycles

    @property
    def serial(self) -> bool:
        """Whether the datapath needs the time between two ticks."""
        raise NotImplementedError

    @property
    def datapath_latency(self) -> int:
        """Clocks from `tick` to the native velocity."""
        raise NotImplementedError

    @property
    def output_serial(self) -> bool:
        """Whether `velocity` is made of the native one bit by bit."""
        output = self.output
        return output is not None and len(output.digits) > 2 and self.has_room(output.serial_latency)

    @property
    def output_latency(self) -> int:
        """Clocks from the native velocity to `velocity`."""
        output = self.output
        if output is None:
            return 0
        return output.serial_latency if self.output_serial else output.pipelined_latency

    @property
    def tick_to_velocity(self) -> int:
        """Clocks from `tick` to `velocity_valid`."""
        return self.datapath_latency + self.low_pass_latency + self.output_latency

    @property
    def remembered_clocks(self) -> int:
        """Clocks of right counts after which the method remembers nothing from before."""
        raise NotImplementedError

    @property
    def method_ports(self) -> tuple[Port, ...]:
        """Outputs that only this method has; they are new with `velocity_valid`."""
        return ()

    @property
    def bound_ports(self) -> tuple[Port, ...]:
        """What encloses the true speed."""
        if not self.bounds:
            return ()
        width = self.bound_width if self.output is None else self.output.port_width
        none = self.shown_bound_limit
        return (
            *(
                held(
                    *(UPDATE, name, width),
                    signed=True,
                    unit=f"2^{-self.frac_bits} {self.unit}",
                    help=f"{side} end of what the true mean speed over the measured window was; {towards * none} means "
                    "that there is none.",
                )
                for (name, towards), side in zip(BOUNDS.items(), ("Lower", "Upper"), strict=True)
            ),
            held(UPDATE, "bounds_valid", help="There are bounds; not yet for the first measurement."),
        )

    @property
    def ports(self) -> tuple[Port, ...]:
        """Ports of the exported core, in order."""
        return ports_of(self)

    @property
    def pins(self) -> tuple[Port, ...]:
        """Inputs beside clock and reset."""
        return tuple(port for port in self.ports if port.direction == "input" and port.name not in ("clk", "rst"))

    @property
    def outputs(self) -> tuple[Port, ...]:
        """Outputs of the exported core, in order."""
        return tuple(port for port in self.ports if port.direction == "output")

    @property
    def strobes(self) -> dict[str, tuple[str, ...]]:
        """Outputs that strobe, each with the names of the outputs that are new with it."""
        outputs = self.outputs
        return {
            strobe.name: tuple(
                port.name for port in outputs if port.held_by == strobe.name and port.name != strobe.name
            )
            for strobe in outputs
            if strobe.is_strobe
        }

    @property
    def parameters(self) -> dict[str, Any]:
        """Every option in canonical form, defaults included."""
        common = {
            "method": self.method,
            "pulses_per_rev": self.encoder.pulses_per_rev,
            "decoding": self.encoder.decoding,
            "clock_hz": self.timing.clock_hz,
            "tick_cycles": self.timing.tick_cycles,
            "max_ticks": self.timing.max_ticks,
            "unit": self.unit,
            "frac_bits": self.frac_bits,
            "velocity_bits": self.velocity_bits,
            "max_speed": None if self.max_speed is None else str(self.max_speed),
            "position_width": self.position_width,
            "filter_clocks": self.filter_clocks,
            "index": self.index,
            "index_reset": self.index_reset,
            "max_tick_cycles": self.max_tick_cycles,
            "age": self.age,
            "bounds": self.bounds,
            "lowpass": None if self.lowpass is None else f"{float(self.lowpass)!r}rad/s",
        }
        return common | {item.name: getattr(self, item.name) for item in options_of(type(self))}

    def seconds(self, clocks: int) -> Fraction:
        """A number of clocks in seconds, exactly."""
        return Fraction(clocks, self.timing.clock_hz)
