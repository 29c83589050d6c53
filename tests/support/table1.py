"""Table 1 of Rairán 2013, line by line, on pulses of constant period."""

from dataclasses import dataclass
from itertools import pairwise

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
    """Pulses at `first_pulse` and every `period` after it, all in ts. Visits the times at which something happens."""
    c_ep = c_dt = n_ep1 = start = 0
    n_dt1 = 1
    pulse = first_pulse
    updates: list[int] = []
    outputs = set()
    while len(updates) < 2 * WINDOWS:
        time = min(pulse, start + dt)
        lep = time == pulse
        if lep and c_dt != 0:
            n_dt1, start = c_dt, time
            updates.append(time)
        if time == start + dt and c_ep != 0:
            n_ep1 = c_ep
        if lep:
            c_ep, c_dt = c_ep + 1, 0
            pulse += period
        if time == start + dt:
            c_dt, c_ep, start = c_dt + 1, 0, time
        if len(updates) > WINDOWS:
            outputs.add((n_ep1, n_dt1))
    settled = updates[WINDOWS:]
    return Steady(outputs, {after - before for before, after in pairwise(settled)})
