"""Sine and cosine by CORDIC (Volder 1959), which turns a vector by the arc tangent of 2^-step, or by a table."""

import math

AHEAD_BITS = 4
STEPS = 1 << AHEAD_BITS  # one a clock; so many clocks from an angle at its port to its sine
WIDTH = 20  # bits of a word, and of a turn
GUARD_BITS = 3  # of a word, below those of the result
ONE = 32767  # the greatest sine
TURNS = tuple(round(math.atan(2.0**-step) / (2 * math.pi) * (1 << WIDTH)) for step in range(STEPS))
# All steps together stretch this to ONE, which no result exceeds.
START = round((ONE << GUARD_BITS) * math.prod(math.cos(math.atan(2.0**-step)) for step in range(STEPS))) - 1
# Sines of a quarter turn, each in the middle of 16 angles; how far each of these is from there, in 2^15 radians.
QUARTER = tuple(round(ONE * math.sin((16 * i + 8) * math.tau / (1 << 16))) for i in range(1024))
ASIDE = tuple(round((i - 8) * math.pi) for i in range(16))
FACTOR_SHIFT = 7  # of a sine, which is then a factor of 8 bits
