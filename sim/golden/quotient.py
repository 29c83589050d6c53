"""Golden arithmetic: quotients of integers, rounded."""

import numpy as np
from numpy.typing import NDArray


def round_quotient(
    numerator: NDArray[np.int64], denominator: NDArray[np.int64], frac_bits: int, towards: int = 0
) -> NDArray[np.int64]:
    """2^frac_bits · numerator/denominator as an integer; the denominators are positive.

    The integer part is taken off first, so that nothing overflows while denominators are below 2^(62−frac_bits).

    Parameters
    ----------
    numerator, denominator : int64 arrays, shape (n,)
    frac_bits : int
    towards : int
        ⌊x + ½⌋ (0), ⌊x⌋ (−1) or ⌈x⌉ (1).
    """
    whole, rest = numerator // denominator, numerator % denominator
    # Twice x, and what rounds it, in units of 1/denominator.
    rounding = (denominator, 2 * denominator - 1, 0)[towards]
    return (whole << frac_bits) + ((rest << (frac_bits + 1)) + rounding) // (2 * denominator)
