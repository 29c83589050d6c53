"""The golden M/T method computes eqs. (13) to (16) of Tsuji 2009, window by window."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.methods.timed import Counts, Ints, Measurements, TimedModel, enclosure, with_silences
from tachometry.sim.golden.sorted_lookup import chain, next_place, not_before


class Model(TimedModel):
    """Computes the M/T method."""

    def taken(self, counts: Counts, since: int) -> Measurements:
        spec, n, period = self._spec, len(counts.period), counts.period
        # The first count after reset or a silence only opens; so does the first that is kept.
        first = (counts.gap > spec.form.max_periods) | (np.arange(n) == 0)
        closing = not_before(period, period + spec.form.min_periods + 1)
        if spec.whole_cycles:
            closing = self._whole(counts, closing)
        if spec.form.may_be_late:
            closing = np.maximum(closing, self._free(counts, first))
        ends = np.flatnonzero(chain(np.minimum(closing, next_place(np.flatnonzero(first), n))))
        opening, ends = ends[:-1], ends[1:]
        opening, ends = opening[~first[ends]], ends[~first[ends]]
        none = np.zeros(len(ends), dtype=np.bool_)
        distance, time = self._distance(counts.size, opening, ends), period[ends] - period[opening]
        off = counts.place[ends] - counts.place[opening]
        least, most = enclosure(spec, distance, off, time)
        found = Measurements(
            clock=counts.clock(period[ends]),
            distance=2 * distance,
            displaced=off,
            time=time,
            forced=none,
            beyond=none,
            least=least,
            most=most,
            known=counts.mapped[ends] & counts.mapped[opening],
            opening=opening,
        )
        found = with_silences(spec, counts, found)
        return found[found.clock >= since]

    def _whole(self, counts: Counts, later: Ints) -> Ints:
        """Return the count that closes the window of each opening one; `later`: the first one later than T_c.

        It is the first after a whole number of cycles, if the window has gone through one, and does not turn before.
        """
        spec, n = self._spec, len(later)
        opening, cycle = np.arange(n), spec.encoder.decoding
        through = later - opening  # counts, which are the distance as long as the shaft does not turn
        whole = opening + -(-through // cycle) * cycle
        turns = np.flatnonzero(counts.size[1:] != counts.size[:-1]) + 1
        turn = np.maximum(later, next_place(turns, n))
        latest = np.searchsorted(counts.period, counts.period + 2 * spec.form.min_periods, side="right")
        return np.where(through < cycle, later, np.minimum(np.minimum(whole, turn), latest))

    def _free(self, counts: Counts, first: NDArray[np.bool_]) -> Ints:
        """Return the first count after each opening one with which a division can begin.

        What is being divided is the window that ended with the opening count, or the 0 forced before it.
        """
        clock = counts.clock(counts.period)
        zeros = counts.clock(counts.silences(self._spec.form.max_periods))
        forced = np.append(zeros, -self._spec.form.division_clocks)[np.searchsorted(zeros, clock) - 1]
        begun = np.where(first, forced, clock)
        return np.searchsorted(clock, begun + self._spec.form.division_clocks)

    def _distance(self, size: Ints, opening: Ints, closing: Ints) -> Ints:
        """Return counts from the edge of an opening count to that of a closing one; on the lattice, the tick's last."""
        through = np.cumsum(size)
        whole = through[closing] - through[opening]
        if self._spec.paper_exact:
            return whole
        sign = np.sign(size)
        return whole + (sign[opening] - sign[closing]) // 2
