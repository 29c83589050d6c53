"""The golden low-pass filter computes eq. (22) of Tsuji 2009, update by update."""

import numpy as np

from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec


def _taken(clocks: list[int], intervals: list[int], longest: int, latency: int) -> list[tuple[int, int, int]]:
    """Return what the filter takes: the clock, the row of the update, and the ticks since the one before.

    It takes an update when it has finished the one before. Of the updates that come meanwhile it takes only the last,
    with the ticks of all.
    """
    taken: list[tuple[int, int, int]] = []
    free = 0
    for row, (clock, interval) in enumerate(zip(clocks, intervals, strict=True)):
        if taken and clock < taken[-1][0]:
            before, _, waited = taken[-1]
            taken[-1] = before, row, waited + interval
        else:
            take = max(clock + 1, free)
            taken.append((take, row, min(interval, longest)))
            free = take + latency - 2
    return taken


def filtered(spec: TachometerSpec, ticks: Table, updates: Table) -> Table:
    """Return updates with the filtered velocity in counts per tick, as late as the filter shows them.

    It takes the last update of a shaft at rest as it is.
    """
    if spec.lowpass is None:
        return updates
    form = spec.velocity.low_pass
    tables, low_bits, extra, bits = form.tables, form.low_bits, form.extra_bits, form.factor_bits
    half = 1 << (bits - 1)
    came = updates.clock
    # Ticks from the clock of the update before, or from reset, on.
    intervals = np.diff(np.searchsorted(ticks.clock, came, side="left"), prepend=0)
    clears = (updates.get("rests") & spec.facts.last_at_rest).tolist()
    taken = _taken(came.tolist(), intervals.tolist(), form.max_interval, form.latency)
    y, shown = 0, []
    velocity = updates.velocity.tolist()
    for _, row, interval in taken:
        u = velocity[row] << extra
        places = (interval & ((1 << low_bits) - 1), interval >> low_bits)
        difference = 0 if clears[row] else y - u
        for table, place in zip(tables, places, strict=False):
            difference = (table[place] * difference + half) >> bits
        y = u + difference
        shown.append((y + (1 << (extra - 1))) >> extra)

    done = np.array([take for take, _, _ in taken], dtype=np.int64) + form.latency - 1
    rows = np.array([row for _, row, _ in taken], dtype=np.int64)
    return updates.rows(rows).having(clock=done, velocity=np.array(shown, dtype=np.int64))
