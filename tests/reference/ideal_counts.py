"""Pulse numbers of an ideal encoder at constant speed, in exact integers, and the windows of T, M/T and S on them."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Windows:
    """Windows one after the other, shape (n,): the pulse sum without the opening tick, and both pulse numbers."""

    pulse_sum: Ints
    m_s: Ints
    opening: Ints
    closing: Ints


def speeds() -> Iterator[tuple[int, int, int]]:
    """Yield (p, q, c): p/q counts per tick, not a whole number, from 1/100 to 40, and the phase c/q of a count."""
    rng = np.random.default_rng(9)
    near = [
        (k * q + d, q) for k in (0, 1, 2, 7, 30) for q, d in ((1001, 125), (1001, 143), (1001, 870), (7, 3), (9, 5))
    ]
    anywhere = [(int(q * 10 ** rng.uniform(-2, 1.6)), int(q)) for q in rng.integers(5_000, 100_000, size=60)]
    for p, q in near + anywhere:
        if p % q:
            for c in (0, q // 3, q - 1):
                yield p, q, c


def positions(p: int, q: int, c: int, n_ticks: int) -> Ints:
    """Return counts since the start at the end of each tick, shape (n_ticks,)."""
    return (np.arange(1, n_ticks + 1) * p + c) // q


def from_ticks(position: Ints, ends: Ints) -> Windows:
    """Return windows from each of these ticks to the next."""
    m_e = np.diff(position, prepend=0)
    return Windows(np.diff(position[ends]), np.diff(ends), m_e[ends[:-1]], m_e[ends[1:]])


def mt_windows(position: Ints, m_c: int) -> Windows:
    """Return from a tick with a count to the first such tick at least m_c later; m_c = 1 is the T method below ω_u."""
    counted = np.flatnonzero(np.diff(position, prepend=0))
    ends = [counted[0]]
    while (following := np.searchsorted(counted, ends[-1] + m_c)) < len(counted):
        ends.append(counted[following])
    return from_ticks(position, np.array(ends))


def s_windows(position: Ints) -> Windows:
    """Return from alteration to alteration, once a pulse number has come twice and two windows are over."""
    m_e = np.diff(position, prepend=0)
    last, usual, ends = m_e[0], m_e[0], []
    for tick, number in enumerate(m_e):
        if number not in (last, usual):
            ends.append(tick)
        else:
            usual = number
        last = number
    settled = int(np.flatnonzero(m_e[1:] == m_e[:-1])[0]) + 1
    return from_ticks(position, np.array([end for end in ends if end > settled][1:]))
