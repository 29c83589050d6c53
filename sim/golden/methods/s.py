"""The golden S method computes the sums of Tsuji 2009, eqs. (17) and (21), as they stand in the paper."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Table
from tachometry.spec import STachometer
from tachometry.spec.core.ports import BOUNDS


def alterations(m_e: NDArray[np.int64], before: tuple[int, int] = (0, 0)) -> NDArray[np.bool_]:
    """Return pulse alterations of Tsuji 2009, Sec. V-A.

    alt(i) = m_e(i) ≠ m_e(i−1) and m_e(i) ≠ b, b = the pulse number of the last tick without an alteration, and 0 before
    the first tick. `before` has b and the pulse number of the tick before.

    While the number changes in every tick, only a tick that equals b does not alter, which leaves b as it is. So b is
    the pulse number of the last tick that equals its predecessor, and nothing has to be followed tick by tick.
    """
    numbers = np.append(before, m_e)
    altered: NDArray[np.bool_] = (numbers[2:] != numbers[1:-1]) & (numbers[2:] != _steady(numbers)[1:-1])
    return altered


def _steady(numbers: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the last of the numbers up to each that equals its predecessor, or the first."""
    changes = np.diff(numbers, prepend=numbers[:1]) != 0
    return numbers[np.maximum.accumulate(np.where(changes, 0, np.arange(len(numbers))))]


def windows(
    alteration: NDArray[np.bool_], max_ticks: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.bool_]]:
    """Return closing tick i, length m_s of every update, and whether it is forced; shape (u,).

    A window closes at an alteration, which opens the next, or when it has grown to `max_ticks`: then it keeps its newer
    half, ⌊max_ticks/2⌋ ticks. The first opens at tick −1.
    """
    at = np.flatnonzero(alteration)
    opening = np.concatenate([[-1], at])
    end = np.concatenate([at, [len(alteration)]])  # the first tick that cannot be forced any more
    kept = max_ticks // 2
    stride = max_ticks - kept
    n_forced = np.maximum(0, (end - 1 - opening - max_ticks) // stride + 1)

    nth = np.arange(n_forced.sum()) - np.repeat(np.cumsum(n_forced) - n_forced, n_forced)
    forced_at = np.repeat(opening, n_forced) + max_ticks + nth * stride
    # An alteration after k forced updates ends a window that they have moved on by k strides.
    at_length = (at - opening[:-1] - n_forced[:-1] * stride).astype(np.int64)

    closing = np.concatenate([at, forced_at])
    m_s = np.concatenate([at_length, np.full(len(forced_at), max_ticks)])
    forced = np.arange(len(closing)) >= len(at)
    order = np.argsort(closing, kind="stable")
    return closing[order], m_s[order], forced[order]


def _off(m_e: NDArray[np.int64], above: NDArray[np.int64], below: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return twice by how much the middle of each tick is off, from the edges about the places at the ends of ticks.

    A tick of more counts than the one before is as far off as its first and its last edge, others as far as the edges
    around these.
    """
    above_was, below_was, m_was = (np.append(0, each)[:-1] for each in (above, below, m_e))
    return np.where(m_e > m_was, above_was + below, below_was + above)


class Model:
    """Computes the S method."""

    def __init__(self, spec: STachometer) -> None:
        self._spec = spec
        self._numbers = np.zeros(1, dtype=np.int64)  # those of ticks since the window opened, at first m_e(−1) = 0
        self._steady = self._n = 0  # b of `alterations`; updates

    def updates(self, ticks: Table, steps: Steps | None, n_clocks: int) -> Table:
        """Return the updates of the next ticks, with the velocity in counts per tick as the datapath has it."""
        spec, m_e, most, before = self._spec, ticks.pulse_count, self._spec.timing.max_ticks, len(self._numbers)
        latest = self._steady, int(self._numbers[-1])
        altered = np.append(np.zeros(before - 1, dtype=np.bool_), alterations(m_e, latest))
        i, m_s, forced = windows(altered, most)
        at = i + 1  # the number with which the first window opens comes first
        numbers = np.append(self._numbers, m_e)
        self._steady = int(_steady(np.append(latest, m_e))[-1])
        opening = np.append(0, at - forced * (most // 2))[-1]
        self._numbers = numbers[opening:]
        total = np.concatenate([[0], np.cumsum(numbers)])  # total[k] = sum of the first k numbers
        if spec.cancel:
            # Eq. (21), doubled: m_e(i−m_s) + 2·Σ_{j=1}^{m_s−1} m_e(i−j) + m_e(i), over 2·m_s.
            numerator = numbers[at - m_s] + 2 * (total[at] - total[at - m_s + 1]) + numbers[at]
        else:
            # Eq. (17): Σ_{j=0}^{m_s−1} m_e(i−j), over m_s.
            numerator = total[at + 1] - total[at - m_s + 1]

        finer = 1
        if spec.displacement is not None and steps is not None and steps.around is not None:
            finer = spec.displacement.per_count
            off = np.append(0, _off(m_e, *steps.around(ticks.clock - spec.latency.tick + 1)))
            numerator = numerator * finer + off[at] - off[at - m_s]

        def quotient(counts: int, towards: int) -> NDArray[np.int64]:
            whole = 2 if spec.cancel else 1
            # In eighths of a count, which edges may be off by.
            more = int(8 * counts * (1 + spec.bound.edge_error))
            return round_quotient(
                8 * numerator + whole * more, 8 * whole * finer * m_s, spec.velocity.native_frac_bits, towards
            )

        columns = {"velocity": quotient(0, 0), "interval": m_s, "forced": forced}
        if spec.bounds:
            columns |= {name: quotient(one, one) for name, one in BOUNDS.items()}
            columns["bounds_valid"] = np.arange(self._n, self._n + len(i)) > 0
        self._n += len(i)
        return Table(ticks.clock[at - before] + spec.latency.datapath, columns)
