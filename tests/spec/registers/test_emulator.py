"""Units of the encoder emulator, from what a shaft does."""

import math

import pytest

from tachometry.spec import Encoder, STachometer, Timing
from tachometry.spec.registers.emulator import (
    BOUNCE_BITS,
    BOUNCE_WIDTH,
    DROP_BITS,
    DROP_WIDTH,
    ERROR_WIDTH,
    FINE_WIDTH,
    JITTER_WIDTH,
    PHASE_WIDTH,
    RANDOM_TAP,
    RANDOM_WIDTH,
    START,
    fastest,
    rad_per_s,
    rate_of,
    speed_of,
)

SPEC = STachometer(encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"))


def test_a_speed_a_rate_and_the_fastest() -> None:
    """A rate changes the speed every second clock, in 2^-16 of its LSB; lines are at least eight clocks long."""
    periods = 100 / (2 * math.pi) * 500  # a second, at 100 rad/s
    assert speed_of(SPEC, 100) == round(periods / 48e6 * 2**32)
    assert rad_per_s(SPEC, speed_of(SPEC, 100)) == pytest.approx(100, rel=1e-5)
    clocks = 4_800_000  # a tenth of a second
    assert rate_of(SPEC, 1000) * (clocks // 2) / 2**16 == pytest.approx(speed_of(SPEC, 100), rel=1e-3)
    assert fastest(SPEC) * 500 / (2 * math.pi) == pytest.approx(48e6 / 8)
    assert (2**PHASE_WIDTH, 8 * START, 2**FINE_WIDTH) == (2**32, 2**32, 1024)


def test_how_wrong_the_lines_can_be() -> None:
    """Edges come an eighth of a period late or early, and move by a sixteenth. Bounces are shorter than 256 clocks."""
    eighth, sixteenth = (2**FINE_WIDTH // n for n in (8, 16))
    widths = [2 ** (ERROR_WIDTH - 1), 2**JITTER_WIDTH, 2**BOUNCE_WIDTH, 2**DROP_WIDTH]  # errors are signed
    assert widths == [eighth, sixteenth, 256, 256]


def test_the_random_bits_come_again_after_the_longest_time() -> None:
    """The polynomial x^31 + x^28 + 1 has no factor, as x^(2^31) is x modulo it, and 2^31 − 1 and 31 are primes."""
    polynomial = 1 << RANDOM_WIDTH | 1 << RANDOM_TAP | 1

    def remainder(number: int) -> int:
        while (more := number.bit_length() - polynomial.bit_length()) >= 0:
            number ^= polynomial << more
        return number

    power = 0b10  # x
    for _ in range(RANDOM_WIDTH):
        power = remainder(int(f"{power:b}", 4))  # the square has a 0 between two bits
    assert (RANDOM_WIDTH, power) == (31, 0b10)
    bits = [*BOUNCE_BITS, *(first + more for first in DROP_BITS for more in range(DROP_WIDTH))]
    assert max(bits) < RANDOM_WIDTH
