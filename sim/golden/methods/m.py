"""The golden M method computes eq. (6) of Tsuji 2009 as it stands in the paper."""

import numpy as np

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.quotient import round_quotient
from tachometry.sim.signals.run import Table
from tachometry.spec import MTachometer
from tachometry.spec.core.ports import BOUNDS


class Model:
    """Computes the M method."""

    def __init__(self, spec: MTachometer) -> None:
        self._spec = spec
        self._before, self._n = np.zeros(spec.average, dtype=np.int64), 0  # numbers of the last ticks; ticks

    def updates(self, ticks: Table, steps: Steps | None, n_clocks: int) -> Table:
        """Return the updates of the next ticks, with the velocity in counts per tick as the datapath has it."""
        n, first = self._spec.average, self._n
        m_e = np.append(self._before, ticks.pulse_count)
        self._before, self._n = m_e[-n:], first + len(ticks)
        sums = np.cumsum(m_e)
        total, length = sums[n:] - sums[:-n], np.full(len(ticks), n)

        def quotient(counts: int, towards: int) -> np.ndarray:
            # In eighths of a count, which edges may be off by.
            more = int(8 * counts * (1 + self._spec.bound.edge_error))
            return round_quotient(8 * total + more, 8 * length, self._spec.velocity.native_frac_bits, towards)

        columns = {"velocity": quotient(0, 0), "interval": length, "forced": np.zeros(len(ticks), dtype=np.bool_)}
        if self._spec.bounds:
            columns |= {name: quotient(one, one) for name, one in BOUNDS.items()}
            columns["bounds_valid"] = np.arange(first, self._n) >= n
        return Table(ticks.clock + self._spec.latency.datapath, columns)
