"""The golden T method computes eq. (9) of Tsuji 2009, count by count."""

import numpy as np

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.methods.timed import Counts, Measurements, enclosure, updates, with_silences
from tachometry.sim.golden.sorted_lookup import chain, next_place, not_before
from tachometry.sim.signals.run import Table
from tachometry.spec import TTachometer


class Model:
    """Computes the T method."""

    def __init__(self, spec: TTachometer) -> None:
        self._spec = spec

    def updates(self, ticks: Table, steps: Steps, n_clocks: int) -> Table:
        """Return all updates below `n_clocks` clocks, with the velocity in counts per tick as the datapath has it."""
        spec = self._spec
        counts = Counts.of(spec, ticks, steps, n_clocks)
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
        )
        opened = (gap <= spec.form.max_periods) & (np.arange(len(gap)) > 0)
        asked = with_silences(spec, counts, found[opened | many])
        # What comes while the divider is at work is not measured; but a 0 is always forced.
        following = not_before(asked.clock, asked.clock + spec.form.division_clocks)
        next_zero = next_place(np.flatnonzero(asked.forced), len(following))
        taken = asked[chain(np.minimum(following, next_zero))]
        return updates(spec, counts, taken, ticks)
