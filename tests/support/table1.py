"""Table 1 of Rairán 2013 on pulses of constant period."""

from dataclasses import dataclass
from itertools import count, pairwise

from tachometry.sim.theory.table1 import table1_rows

WINDOWS = 4  # to get in step, and then to be looked at


@dataclass(frozen=True)
class Steady:
    """Computes Table 1 once it is in step with the pulses.

    Parameters
    ----------
    outputs : all (Nep1, Ndt1) that it returns
    update_times : all times between updates of Ndt1, in ts
    """

    outputs: set[tuple[int, int]]
    update_times: set[int]


def table1(period: int, dt: int, first_pulse: int) -> Steady:
    """Return pulses at `first_pulse` and every `period` after it, all in ts."""
    duration = first_pulse + 2 * WINDOWS * (period + 2 * dt)
    rows = table1_rows(count(first_pulse, period), dt, duration)
    updates = [k for k, row in enumerate(rows) if row.new_n_dt1]
    settled = rows[updates[WINDOWS] : updates[2 * WINDOWS - 1] + 1]
    times = [row.time for row in settled if row.new_n_dt1]
    return Steady({(row.n_ep1, row.n_dt1) for row in settled}, {after - before for before, after in pairwise(times)})
