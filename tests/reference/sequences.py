"""Pulse numbers and what the S method must make of them, worked out by hand from the words of Tsuji 2009.

Each sequence is (pulse numbers, updates); an update is (tick, m_s, forced, eq. (17), eq. (21)).
"""

from fractions import Fraction as F

Update = tuple[int, int, bool, F, F]
Sequence = tuple[list[int], list[Update]]

MAX_TICKS = 8

PAPER: dict[str, Sequence] = {
    # 3.25 ω_u: a 4 after three 3s, always. The 4 is the alteration, the return to 3 is none, and every estimate from
    # the second window on is 3.25.
    "3.25 units": (
        [3, 3, 3, 4, 3, 3, 3, 4, 3, 3, 3, 4],
        [
            (0, 1, False, F(3), F(3, 2)),
            (3, 3, False, F(10, 3), F(19, 6)),
            (7, 4, False, F(13, 4), F(13, 4)),
            (11, 4, False, F(13, 4), F(13, 4)),
        ],
    ),
    # Fig. 4(c): an occasional pulse upon an offset of 2; the sum over a window does not fluctuate.
    "Fig. 4(c)": (
        [2, 2, 3, 2, 2, 3, 2, 2, 3, 2, 2],
        [
            (0, 1, False, F(2), F(1)),
            (2, 2, False, F(5, 2), F(9, 4)),
            (5, 3, False, F(7, 3), F(7, 3)),
            (8, 3, False, F(7, 3), F(7, 3)),
        ],
    ),
    # Sec. V-D: alternate alterations of size 1 around a multiple of the unit velocity cancel, as in Fig. 9(b).
    "3 2 4 3 3": (
        [3, 3, 3, 2, 4, 3, 3],
        [(0, 1, False, F(3), F(3, 2)), (3, 3, False, F(8, 3), F(17, 6)), (4, 1, False, F(4), F(3))],
    ),
    "1 2 0 1": (
        [1, 1, 1, 2, 0, 1, 1],
        [(0, 1, False, F(1), F(1, 2)), (3, 3, False, F(4, 3), F(7, 6)), (4, 1, False, F(0), F(1))],
    ),
    # Fig. 10: the shaft swings over one edge at rest; the average velocity between alternate pulses is 0.
    "+1 -1 at rest": (
        [0, 0, 1, -1, 0, 0, 1, 0, -1, 0],
        [
            (2, 3, False, F(1, 3), F(1, 6)),
            (3, 1, False, F(-1), F(0)),
            (6, 3, False, F(1, 3), F(0)),
            (8, 2, False, F(-1, 2), F(0)),
        ],
    ),
    # Sec. V-B: the velocity is calculated when the measurement has lasted as long as it may. The window then keeps its
    # newer half: the count after it is no spike, but one in the m_s ticks that are still in the window.
    "forced, then a count": (
        [1] + [0] * 13 + [1, 0],
        [
            (0, 1, False, F(1), F(1, 2)),
            (8, 8, True, F(0), F(1, 16)),
            (12, 8, True, F(0), F(0)),
            (14, 6, False, F(1, 6), F(1, 12)),
        ],
    ),
    # An alteration in the very tick in which the update would be forced is an alteration.
    "alteration at max_ticks": ([2] + [0] * 7 + [1, 0], [(0, 1, False, F(2), F(1)), (8, 8, False, F(1, 8), F(3, 16))]),
    "standstill": ([0] * 17, [(7, 8, True, F(0), F(0)), (11, 8, True, F(0), F(0)), (15, 8, True, F(0), F(0))]),
    "reversal": ([2, 2, 2, -1, -1, -1], [(0, 1, False, F(2), F(1)), (3, 3, False, F(1), F(3, 2))]),
}


def rounded(value: F, frac_bits: int) -> int:
    """Return ⌊2^f·x + ½⌋."""
    return (value * 2 ** (frac_bits + 1) + 1) // 2
