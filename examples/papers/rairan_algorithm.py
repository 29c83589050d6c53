"""Figs. 2 and 3 of Rairán 2013 show Table 1 at work, and its estimate over speed."""

import numpy as np

from papers.lab import Lab
from papers.rairan_equations import Row, rairan_eq01_update_time, rairan_eq03_error, rairan_eq04_max_error, table1_rows
from papers.result import Claim, Curve, Panel, Result
from tachometry.sim.theory.rairan import rairan_update_time

_DT = 1000  # ts


def _example(ratio: float, first: float, windows: int) -> list[Row]:
    """Return table 1 at a constant speed of so many ω_lim, from a first pulse at `first` dt on, for so many dt."""
    period = _DT / ratio
    n_pulses = int(windows * ratio) + 1
    pulses = np.rint(first * _DT + period * np.arange(n_pulses)).astype(np.int64)
    return table1_rows(pulses.tolist(), _DT, windows * _DT)


def _letters(rows: list[Row]) -> list[str]:
    """Return letters of the events from a on; ends of dt in a row that update nothing have one together."""
    letters, number = [], -1
    for before, row in zip([None, *rows], rows, strict=False):
        alike = before is not None and _idle(before) and _idle(row)
        number += not alike
        letters.append(chr(ord("a") + number))
    return letters


def _idle(row: Row) -> bool:
    return row.end and not row.pulse and not row.new_n_ep1


def _updating(rows: list[Row], chosen: str) -> str:
    """Return the first two events in which something was updated."""
    letters = [letter for letter, row in zip(_letters(rows), rows, strict=True) if getattr(row, chosen)]
    return " and ".join(letters[:2])


def _settled(rows: list[Row]) -> str:
    """Return the last event that changed the estimate."""
    return _letters(rows)[max(k for k in range(1, len(rows)) if rows[k].n1 != rows[k - 1].n1)]


def _example_panels(title: str, rows: list[Row]) -> tuple[Panel, Panel]:
    time = np.array([row.time for row in rows]) / _DT

    def events(which: str, height: float) -> Curve:
        at = time[[getattr(row, which) for row in rows]]
        return Curve({"pulse": "lep", "end": "dt"}[which], at, np.full(len(at), height), "dots")

    counters = [
        Curve(label, time, np.array([getattr(row, name) for row in rows], dtype=np.float64), "held")
        for label, name in (("$Cep$", "c_ep"), ("$Cdt$", "c_dt"), ("$Nep_1$", "n_ep1"), ("$Ndt_1$", "n_dt1"))
    ]
    estimate = np.array([row.n1 for row in rows])
    marks: dict[str, float] = {}
    for letter, at in zip(_letters(rows), time.tolist(), strict=True):
        marks.setdefault(letter, at)
    return (
        Panel(
            title,
            "time (dt)",
            "count",
            (*counters, events("pulse", -0.4), events("end", -0.8)),
            whole=True,
            marks=tuple(marks.items())[:8],
            y_limits=(-1.2, max(row.n_ep1 + row.n_dt1 for row in rows) - 0.2),
        ),
        Panel("", "time (dt)", "$n_1$", (Curve("$n_1$", time, estimate, "held"),)),
    )


def fig2(lab: Lab) -> Result:
    """Compute fig. 2: examples of algorithm use."""
    examples = {"a": (0.24, 1.5, 16), "b": (1.5, 0.2, 8)}
    panels: list[Panel] = []
    runs = {}
    for name, (ratio, first, windows) in examples.items():
        rows = runs[name] = _example(ratio, first, windows)
        panels += _example_panels(f"({name}) ω = {ratio:g} ω_lim", rows)
    by_pulse = all(row.pulse for rows in runs.values() for row in rows if row.new_n_dt1)
    by_end = all(row.end for rows in runs.values() for row in rows if row.new_n_ep1)
    times, claimed, exact = [], [], []
    for name, (ratio, _, _) in examples.items():
        updated = np.diff([row.time for row in runs[name] if row.new_n_dt1])
        times.append(float(np.mean(updated)) / _DT)
        claimed.append(float(rairan_eq01_update_time(ratio, 1, 1)))
        exact.append(float(rairan_update_time(ratio, 1, 1)))
    last = {name: rows[-1].n1 for name, rows in runs.items()}
    return Result(
        "Rairán 2013, Fig. 2",
        "examples of algorithm use",
        f"Table 1 to the letter, dt = {_DT} ts; the speed in (a) is ≈ 0.25 in the paper; letters as in the paper",
        tuple(panels),
        (
            Claim(
                "Ndt1 is updated with pulses, Nep1 with dt: in the events d and g of both",
                f"so all updates; Nep1 first in {_updating(runs['a'], 'new_n_ep1')} of (a), "
                f"{_updating(runs['b'], 'new_n_ep1')} of (b)",
                by_pulse and by_end and all(_updating(rows, "new_n_ep1") == "d and g" for rows in runs.values()),
            ),
            Claim(
                "the estimate remains constant from f on in (a), from d on in (b)",
                f"(a) {last['a']:g} from {_settled(runs['a'])} on; (b) {last['b']:g} from {_settled(runs['b'])} on",
                last["a"] == 1 / 4 and last["b"] == 2 and _settled(runs["a"]) == "f" and _settled(runs["b"]) == "d",
            ),
            Claim(
                "the time between updates is (ω_lim/ω) dt in (a) and eq. (1) in (b)",
                f"(a) {times[0]:.3f} dt, by the paper {claimed[0]:.3f}; (b) {times[1]:.3f} dt, by the paper "
                f"{claimed[1]:.3f}: Table 1 takes (⌊r⌋ + 1)/r = {exact[1]:.3f}, r = ω/ω_lim, and eq. (1) joins its "
                "values at whole r by straight lines",
                bool(np.allclose(times, claimed, rtol=2e-3)),
            ),
        ),
    )


def _estimates(top: float) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds in ω_lim, increasing, and n1 of Table 1 at them once it is in step."""
    dt = 2520  # divisible by 1 to 10: the ends of all intervals are met
    periods = np.unique(np.rint(dt / np.linspace(0.125, top, 900)).astype(np.int64))
    ends = np.array([dt * k for k in range(1, 9)] + [dt // k for k in (2, 3, 4)])
    periods = np.union1d(periods, (ends[:, np.newaxis] + [-1, 0, 1]).ravel())
    periods = periods[(periods >= dt / top) & (periods <= 8 * dt + 1)]
    n1 = []
    for period in periods.tolist():
        pulses = range(dt // 3, 40 * max(period, dt), period)
        n1.append(table1_rows(pulses, dt, 6 * (period + dt))[-1].n1)
    return dt / periods[::-1], np.array(n1[::-1])


def fig3(lab: Lab) -> Result:
    """Compute fig. 3: speed estimation and relative error for the proposed algorithm."""
    speed, n1 = _estimates(4.5)
    error = rairan_eq03_error(n1, speed, 1)
    bound = rairan_eq04_max_error(n1)
    worst = {n: 100 * float(error[n1 == n].max()) for n in (3.0, 0.5)}
    speed_label = "ω/ω_lim"
    return Result(
        "Rairán 2013, Fig. 3",
        "speed estimation and relative error for the proposed algorithm",
        "Table 1 to the letter, dt = 2520 ts, constant speeds",
        (
            Panel("", speed_label, "ω_m1/ω_lim", (Curve("$n_1$", speed, n1), Curve("ω", speed, speed, "reference"))),
            Panel(
                "",
                speed_label,
                "relative error (%)",
                (Curve("$e_{r1}$, eq. (3)", speed, 100 * error), Curve("eq. (4)", speed, 100 * bound, "reference")),
            ),
        ),
        (
            Claim(
                "Nep1 is the ceiling, Ndt1 the floor: the estimate is always greater than the speed",
                f"at all {len(speed)} speeds n1 ≥ ω/ω_lim; equal at the right end of the intervals above ω_lim",
                bool(np.all(n1 >= speed * (1 - 1e-12))),
            ),
            Claim(
                "the relative error is greatest at the left of each interval: 50 % at n1 = 3 and at n1 = 1/2",
                f"{worst[3.0]:.2f} % at n1 = 3, where it is a supremum; {worst[0.5]:.2f} % at n1 = 1/2, attained",
                bool(abs(worst[3.0] - 50) < 0.2 and abs(worst[0.5] - 50) < 1e-9),
            ),
            Claim(
                "eq. (4) is the maximum relative error of each interval",
                f"never exceeded: at most {100 * float(np.max(error / bound)):.4g} % of it",
                bool(np.all(error <= bound * (1 + 1e-12))),
            ),
        ),
    )
