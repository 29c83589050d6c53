"""The golden T method computes eq. (9) of Tsuji 2009, count by count."""

import numpy as np

from tachometry.sim.golden.methods.timed import Counts, Measurements, TimedModel, enclosure, with_silences
from tachometry.sim.golden.sorted_lookup import chain, next_place, not_before


class Model(TimedModel):
    """Computes the T method."""

    def taken(self, counts: Counts, since: int) -> Measurements:
        spec = self._spec
        sign, gap = np.sign(counts.size), counts.gap
        many = np.abs(counts.size) > 1
        same = np.append(False, sign[1:] == sign[:-1])[: len(sign)] | spec.paper_exact | many
        none = np.zeros(len(sign), dtype=np.bool_)
        distance, time = np.where(same, sign, 0), np.where(many, 1, gap)
        off = np.diff(counts.place, prepend=0)
        least, most = enclosure(spec, distance, off, time)
        found = Measurements(
            clock=counts.clock(counts.period),
            distance=2 * distance,
            displaced=off,
            time=time,
            forced=none,
            beyond=many,
            least=least,
            most=most,
            known=~many & counts.mapped & np.append(False, counts.mapped)[:-1],
            opening=np.maximum(np.arange(len(gap)) - 1, 0),
        )
        opened = (gap <= spec.form.max_periods) & (np.arange(len(gap)) > 0)
        asked = with_silences(spec, counts, found[opened | many])
        asked = asked[asked.clock >= since]
        # What comes while the divider is at work is not measured; but a 0 is always forced.
        following = not_before(asked.clock, asked.clock + spec.form.division_clocks)
        next_zero = next_place(np.flatnonzero(asked.forced), len(following))
        return asked[chain(np.minimum(following, next_zero))]
