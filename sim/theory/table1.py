"""Table 1 of Rairán 2013 is followed here to the letter, from event to event."""

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Row:
    """Holds the entries of Table 1 after an event."""

    time: int  # ts
    # pulse and end: a pulse came (lep), dt ended
    pulse: bool
    end: bool
    # c_ep, c_dt, n_ep1 and n_dt1: Cep, Cdt, Nep1, Ndt1
    c_ep: int
    c_dt: int
    n_ep1: int
    n_dt1: int
    # new_n_ep1 and new_n_dt1: Nep1 (line 9), Ndt1 (line 6) was updated
    new_n_ep1: bool = False
    new_n_dt1: bool = False

    @property
    def n1(self) -> float:
        """The estimate Nep1/Ndt1."""
        return self.n_ep1 / self.n_dt1


def table1_rows(pulses: Iterable[int], dt: int, duration: int) -> list[Row]:
    """Return every event of Table 1, its start first; the lines are those of the paper, in its order.

    - `pulses`, ts, increasing and greater than 0
    - `dt`, ts
    - `duration`, ts
    """
    rows = [Row(0, False, False, 0, 0, 0, 1)]
    coming = iter(pulses)
    pulse = next(coming, duration + 1)
    c_ep = c_dt = n_ep1 = start = 0  # clock is time − start
    n_dt1 = 1
    while (time := min(pulse, start + dt)) <= duration:
        lep = time == pulse
        new_n_dt1 = lep and c_dt != 0
        if new_n_dt1:  # 5 to 7
            n_dt1, start = c_dt, time
        end = time == start + dt
        new_n_ep1 = end and c_ep != 0
        if new_n_ep1:  # 8, 9
            n_ep1 = c_ep
        if lep:  # 10, 11
            c_ep, c_dt = c_ep + 1, 0
            pulse = next(coming, duration + 1)
        if end:  # 12 to 14
            c_dt, c_ep, start = c_dt + 1, 0, time
        rows.append(Row(time, lep, end, c_ep, c_dt, n_ep1, n_dt1, new_n_ep1, new_n_dt1))
    return rows
