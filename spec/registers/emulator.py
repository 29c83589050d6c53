"""Numbers of the encoder emulator: a period of the lines is 2^32 LSBs of its phase."""

import math
from dataclasses import dataclass

from tachometry.spec.core.tachometer import TachometerSpec

PHASE_WIDTH = 32
RATE_SHIFT = 16  # bits that the speed has below an LSB of the phase
FINE_WIDTH = 10  # bits of the phase that the edges follow
ERROR_WIDTH = 8
JITTER_WIDTH = 6
BOUNCE_WIDTH = 8
DROP_WIDTH = 8
WIRES_WIDTH = 3  # a bit for each of A, B and Z
NOISE_WIDTH = 8
START = 1 << PHASE_WIDTH - 3  # phase after reset: an eighth of a period from the edges at either side

# Random bits: x^31 + x^28 + 1, of which the newest bit is the lowest, one bit a clock.
RANDOM_WIDTH, RANDOM_TAP = 31, 28
# Lowest of the random bits that decide for line A and line B whether an edge is left out, and how it bounces.
DROP_BITS = (14, 22)
BOUNCE_BITS = (3, 17)
NOISE_BIT = 7  # there is noise while this one and more are below the setting, with as many zeros above them

# Clocks after which the emulated lines follow the phase.
LATENCY = 3
READ_AGE = 1  # clocks from the lines to a read of them


@dataclass(frozen=True)
class EmulatorSettings:
    """Sets the emulator; all numbers are as its registers have them."""

    speed: int = 0  # phase a clock that it goes to, signed, 32 bits
    rate: int = 0  # change of the speed in two clocks, in 2^-16; 0: at once
    # phase_error, duty_a and duty_b: how late B rises, A falls and B falls, in 2^-10 periods, signed, 8 bits
    phase_error: int = 0
    duty_a: int = 0
    duty_b: int = 0
    jitter: int = 0  # bits that take part in the edges' random movement, in 2^-10 periods
    bounce: int = 0  # clocks
    drop: int = 0  # so many of 256 edges of each line are left out
    glitches: int = 0  # in so many of 65536 clocks both A and B have the wrong level
    # broken and stuck: bits of A, B and Z: the line is high, as an open input is; it stays as it is
    broken: int = 0
    stuck: int = 0


def speed_of(spec: TachometerSpec, rad_per_s: float) -> int:
    """Return phase a clock at a speed of the shaft."""
    return round(_periods(spec, rad_per_s) / spec.timing.clock_hz * 2**PHASE_WIDTH)


def rad_per_s(spec: TachometerSpec, speed: int) -> float:
    """Return speed of the shaft at a phase a clock."""
    return speed / 2**PHASE_WIDTH * spec.timing.clock_hz / _periods(spec, 1.0)


def rate_of(spec: TachometerSpec, rad_per_s2: float) -> int:
    """Change of the phase a clock in two clocks at an acceleration of the shaft."""
    return round(2 * _periods(spec, rad_per_s2) / spec.timing.clock_hz**2 * 2 ** (PHASE_WIDTH + RATE_SHIFT))


def fastest(spec: TachometerSpec) -> float:
    """Return highest emulated speed in rad/s: an eighth of a period a clock, so that no two lines change at once."""
    return rad_per_s(spec, 1 << PHASE_WIDTH - 3)


def _periods(spec: TachometerSpec, radians: float) -> float:
    """Return periods of a line in an angle of the shaft; of an encoder that is read, an edge is an LSB."""
    return radians / (8 if spec.encoder.sampled else 2) / math.pi * spec.encoder.pulses_per_rev * spec.encoder.turns
