"""Golden arithmetic rounds quotients of integers."""

import numpy as np
from numpy.typing import NDArray


def round_quotient(
    numerator: NDArray[np.int64], denominator: NDArray[np.int64], frac_bits: int, towards: int = 0
) -> NDArray[np.int64]:
    """Return 2^frac_bits · numerator/denominator as an integer; the denominators are positive and below 2^61.

    Where 64 bits do not hold the shifted numerators, it is a long division, some bits at a time, so that no remainder
    overflows. The result must fit.

    - `towards`: ⌊x + ½⌋ (0), ⌊x⌋ (−1) or ⌈x⌉ (1).
    """
    bits = int(np.max(np.abs(numerator), initial=0)).bit_length() + frac_bits
    if max(bits, int(np.max(denominator, initial=1)).bit_length()) < 61:
        shifted = numerator << frac_bits
        if towards == 0:
            return (2 * shifted + denominator) // (2 * denominator)
        return shifted // denominator if towards < 0 else -(-shifted // denominator)
    quotient, rest = numerator // denominator, numerator % denominator
    most = 62 - int(np.max(denominator, initial=1)).bit_length()  # bits at a time
    for bits in [most] * (frac_bits // most) + [frac_bits % most]:
        rest = rest << bits
        quotient, rest = (quotient << bits) + rest // denominator, rest % denominator
    up = (2 * rest >= denominator, rest > 0, rest < 0)[towards]
    return quotient + up.astype(np.int64)
