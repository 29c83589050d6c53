"""Table 1 of Rairán 2013 on pulses of constant period."""

from dataclasses import dataclass
from itertools import count, pairwise

from tachometry.sim.theory.table1 import table1_rows

WINDOWS = 4  # to get in step, and then to be looked at


@dataclass(frozen=True)
class Steady:
    """What Table 1 does once it is in step with the pulses.

    Parameters
    ----------
    outputs : all (Nep1, Ndt1) that it returns
    update_times : all times between updates of Ndt1, in ts
    """

    outputs: set[tuple[int, int]]
    update_times: set[int]


def table1(period: int, dt: int, first_pulse: int) -> Steady:
    """Pulses at `first_pulse` and every `period` after it, all in ts."""
    duration = first_pulse + 2 * WINDOWS * (period + 2 * dt)
    rows = table1_rows(count(first_pulse, period), dt, duration)
    updates = [k for k, row in enumerate(rows) if row.new_n_dt1]
    settled = rows[updates[WINDOWS] : updates[2 * WINDOWS - 1] + 1]
    times = [row.time for row in settled if row.new_n_dt1]
    return Steady({(row.n_ep1, row.n_dt1) for row in settled}, {after - before for before, after in pairwise(times)})


def every_ts(lep: list[int], dt: int) -> list[tuple[int, int]]:
    """(Nep1, Ndt1) that Table 1 returns at every ts, its lines as they are printed; dt in ts."""
    c_ep, c_dt, n_ep1, n_dt1 = 0, 0, 0, 1
    clock = 0
    returned = []
    for impulse in lep:
        clock = clock + 1
        if impulse == 1 and c_dt != 0:
            n_dt1 = c_dt
            clock = 0
        if clock == dt and c_ep != 0:
            n_ep1 = c_ep
        if impulse == 1:
            c_ep = c_ep + 1
            c_dt = 0
        if clock == dt:
            c_dt = c_dt + 1
            c_ep = 0
            clock = 0
        returned.append((n_ep1, n_dt1))
    return returned
