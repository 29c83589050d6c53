"""Figs. 5 and 7 of Rairán 2013 show estimates at variable speeds, and their relative errors."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from papers.lab import Lab
from papers.rairan_equations import (
    rairan_eq04_max_error,
    rairan_eq08_sup_error,
    rairan_eq13_max_error,
    rairan_eq14_max_acceleration,
    rairan_speed_limit,
)
from papers.result import Claim, Curve, Panel, Result
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.signals.run import Run
from tachometry.sim.theory.rairan import rairan_eq05_n2, rairan_eq11_n3
from tachometry.spec import Encoder, RairanTachometer, Speed, Timing

_TURN = 2 * math.pi
_NAMES = ("$ω_{m1}$", "$ω_{m2}$", "$ω_{m3}$")


@dataclass(frozen=True, eq=False)
class _Estimates:
    """Holds the estimates of Table 1 after each update, in ω_lim, from when both counts are there; shape (n,)."""

    clock: NDArray[np.int64]
    n1: FloatArray
    n2: FloatArray
    n3: FloatArray

    @property
    def each(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self.n1, self.n2, self.n3


def _estimates(spec: RairanTachometer, run: Run) -> _Estimates:
    """Return n1 of the counts at the ports, n2 and n3 of it, in the regime that was updated last."""
    updates = run.updates
    unit = 2.0**spec.velocity.frac_bits
    # n3 tells the regime: 2/3 and less is low, 4/3 and more is high.
    n3 = updates.velocity / unit
    shown = n3 > 0
    low = n3[shown] < 1
    n1 = np.where(low, 1 / np.maximum(np.floor(1 / n3[shown] + 1e-3), 1), np.ceil(n3[shown]))
    n2 = rairan_eq05_n2(n1)
    return _Estimates(updates.clock[shown], n1, n2, rairan_eq11_n3(n1, n2))


def _held(at: _Estimates, values: FloatArray, clock: FloatArray) -> FloatArray:
    return values[np.searchsorted(at.clock, clock, side="right") - 1]


def _window_means(spec: RairanTachometer, encoding: Encoding, at: _Estimates) -> FloatArray:
    """Return mean true speed, in counts per dt, over what each update has measured: dt, or the last gap."""
    clock_hz, dt = spec.timing.clock_hz, spec.timing.tick_cycles
    trace = encoding.recording.place(clock_hz)
    counted = trace.clock[1:]  # all edges count, in one direction
    end = at.clock - spec.latency.tick - spec.latency.tick_to_velocity - spec.latency.pin_to_count
    last = counted[np.maximum(np.searchsorted(counted, end, side="left") - 1, 0)]
    begin = np.where(at.n1 > 1, end - dt, last)
    moved = encoding.motion.angle(end / clock_hz) - encoding.motion.angle(begin / clock_hz)
    return moved * spec.encoder.encoder_counts / _TURN / (np.maximum(end - begin, 1) / dt)


def fig5(lab: Lab) -> Result:
    """Compute fig. 5: estimation for variable speed; hardware and golden model in lockstep."""
    pulses, dt, clock_hz = 10_000, 1e-3, 10_000_000
    spec = RairanTachometer(
        encoder=Encoder(pulses // 4),
        timing=Timing(clock_hz, 10_000, 20),
        frac_bits=20,
        max_speed=Speed.parse("1rev/s"),
        bound_decay=False,
    )
    limit = float(rairan_speed_limit(pulses, dt))
    up, down, turn = 0.5 / 60e-3, 0.5 / 40e-3, 60e-3
    encoding = lab.turn(spec, "ramp:0:0.5rev/s:60ms+ramp:0.5rev/s:0rev/s:40ms")
    found = _estimates(spec, lab.lockstep(spec, encoding))
    time = found.clock / clock_hz
    # The first two windows did not begin in step; a ts is a 10,000th of dt.
    mean, slack = _window_means(spec, encoding, found)[2:], 1e-3
    enclosed = (mean >= found.n2[2:] * (1 - slack)) & (mean <= found.n1[2:] * (1 + slack))

    instants = np.arange(int(found.clock[2]), int(encoding.recording.duration * clock_hz), 100).astype(np.float64)
    speed = encoding.true_speed(instants / clock_hz) / _TURN / limit
    n1, n2 = (_held(found, n, instants) for n in (found.n1, found.n2))
    slope = np.where(instants / clock_hz < turn, up, down)
    outside = np.maximum(n2 - speed, speed - n1) / (n1 - n2)
    allowed = slope <= rairan_eq14_max_acceleration(n1, pulses, dt) * (1 + 1e-9)
    most = float(outside[allowed].max())
    ordered = bool(np.all((found.n1 > found.n3) & (found.n3 > found.n2)))
    greatest = float(rairan_eq14_max_acceleration(2, pulses, dt))
    steps = [Curve(name, time, limit * n, "held") for name, n in zip(_NAMES, found.each, strict=True)]
    return Result(
        "Rairán 2013, Fig. 5",
        "estimation ω_mi for variable speed",
        "dt = 1 ms, 10 000 pulses per revolution, ts = 0.1 µs; 8.33 and −12.5 rev/s²",
        (
            Panel(
                "",
                "time (s)",
                "speed (rev/s)",
                (*steps, Curve("ω (true)", instants[::50] / clock_hz, limit * speed[::50], "reference")),
            ),
        ),
        (
            Claim(
                "ω_lim = 0.1 rev/s, so the maximum acceleration is 50 rev/s²",
                f"{limit:g} rev/s and {greatest:g} rev/s² above ω_lim; for Ndt1 = 2, eq. (14) is "
                f"{float(rairan_eq14_max_acceleration(1 / 2, pulses, dt)):.2f} rev/s², the slope of the first ramp",
                bool(math.isclose(limit, 0.1) and math.isclose(greatest, 50)),
            ),
            Claim(
                "ω_m1 is always greater than ω_m3, and ω_m3 than ω_m2",
                f"in {'all' if ordered else 'not all'} {len(time)} updates",
                ordered,
            ),
            Claim(
                "the actual speed on the ramps is between ω_m2 and ω_m1",
                f"in {100 * float(np.mean(outside <= 0)):.0f} % of the time: it runs ahead of what an update has "
                f"measured, the mean speed, which is between them in {np.count_nonzero(enclosed)} of {len(enclosed)} "
                "updates",
                bool(np.all(outside <= 0)),
            ),
            Claim(
                "the bounds also apply to variable speeds, if the acceleration does not go beyond eq. (14)",
                f"where eq. (14) allows the slope, the speed of the moment leaves [ω_m2, ω_m1] by up to {most:.2f} of "
                "its width while the next window is measured",
                most <= 0,
            ),
        ),
    )


def _shown_speeds() -> FloatArray:
    """Return of 43 voltages, from 3 to 24 V by 0.5 V; the speeds are ours, none special."""
    return np.linspace(2.03, 29.17, 43)


def _bounds(speed: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute eqs. (4), (8) and (13) over speeds in ω_lim."""
    n1 = np.where(speed > 1, np.ceil(speed), 1 / np.maximum(np.ceil(1 / speed) - 1, 1))
    return rairan_eq04_max_error(n1), rairan_eq08_sup_error(rairan_eq05_n2(n1)), rairan_eq13_max_error(n1)


def _core(ts: float, to_the_letter: bool) -> RairanTachometer:
    """Return 160 slots, which 40 lines are of which all edges count; dt = 1 ms."""
    return RairanTachometer(
        encoder=Encoder(40),
        timing=Timing(round(1 / ts), round(1e-3 / ts), 50),
        frac_bits=20,
        paper_exact=to_the_letter,
        bound_decay=False,
    )


@dataclass(frozen=True, eq=False)
class _Errors:
    """Holds the relative errors at each speed."""

    # shape (3, n), of the three estimates: mean and greatest, and the greatest share of its bound
    mean: FloatArray
    greatest: FloatArray
    of_bound: FloatArray
    within_ts: NDArray[np.bool_]  # shape (n,): the speed is always between n2 and n1, but for one ts in dt


def _errors(lab: Lab, spec: RairanTachometer, speeds: FloatArray, limit: float, seconds: float) -> _Errors:
    rows, within_ts = [], []
    slack = 1 / spec.timing.tick_cycles
    for speed in speeds.tolist():
        encoding = lab.turn(spec, f"constant:{speed!r}rev/s:{seconds}s", start_angle_rad=0.001)
        found = _estimates(spec, lab.golden(spec, encoding))
        settled = found.clock > seconds / 10 * spec.timing.clock_hz
        each = [np.abs(n[settled] * limit / speed - 1) for n in found.each]
        bounds = (
            rairan_eq04_max_error(found.n1[settled]),
            rairan_eq08_sup_error(found.n2[settled]),
            rairan_eq13_max_error(found.n1[settled]),
        )
        rows.append([(e.mean(), e.max(), np.max(e / bound)) for e, bound in zip(each, bounds, strict=True)])
        low, high = found.n2[settled] / (1 + slack), found.n1[settled] / (1 - slack)
        within_ts.append(bool(np.all((low <= speed / limit) & (speed / limit <= high))))
    mean, greatest, of_bound = np.array(rows).transpose(2, 1, 0)
    return _Errors(mean, greatest, of_bound, np.array(within_ts))


def fig7(lab: Lab) -> Result:
    """Compute fig. 7: relative error for pul = 160, dt = 1 ms, ts = 100 µs; hardware over a short run."""
    pulses, dt, ts = 160, 1e-3, 100e-6
    speeds = _shown_speeds()
    spec = _core(ts, to_the_letter=False)
    lab.lockstep(spec, lab.turn(spec, "+".join(f"constant:{speed!r}rev/s:100ms" for speed in speeds.tolist())))
    limit = float(rairan_speed_limit(pulses, dt))
    letter = _errors(lab, _core(ts, to_the_letter=True), speeds, limit, 10)
    default = _errors(lab, spec, speeds, limit, 10)
    fine = _errors(lab, _core(ts / 100, to_the_letter=False), speeds, limit, 2)
    within, within_letter, within_fine = (
        int(np.count_nonzero(errors.of_bound.max(axis=0) <= 1)) for errors in (default, letter, fine)
    )
    dense = np.linspace(0.9 * speeds[0], 1.02 * speeds[-1], 1000)
    panels = tuple(
        Panel(
            "",
            "speed (rev/s)",
            f"$e_{{r{number}}}$ (%)",
            (
                Curve(f"$e_{{r{number}}}$, greatest", speeds, 100 * default.greatest[number - 1], "dots"),
                Curve("mean of 10 s", speeds, 100 * default.mean[number - 1], "dots"),
                Curve(f"bound, eq. ({equation})", dense, 100 * bound, "reference"),
            ),
        )
        for number, equation, bound in zip((1, 2, 3), (4, 8, 13), _bounds(dense / limit), strict=True)
    )
    least = int(np.count_nonzero(default.greatest[2] <= np.minimum(default.greatest[0], default.greatest[1])))
    n_speeds = len(speeds)
    worst_letter = int(np.argmax(letter.of_bound.max(axis=0)))
    return Result(
        "Rairán 2013, Fig. 7",
        "relative error for pul = 160, dt = 1 ms, and ts = 100 µs",
        f"{n_speeds} constant speeds, 10 s each",
        panels,
        (
            Claim(
                "relative errors always fall within the bounds of eqs. (4), (8) and (13)",
                f"at {within} of {n_speeds} speeds, the greatest error {default.of_bound.max():.2f} of its bound: ts "
                f"is a tenth of dt. But for one ts ω is between ω_m2 and ω_m1 at {int(default.within_ts.sum())}. "
                f"With ts = 1 µs at {within_fine}, the greatest {fine.of_bound.max():.3f}. Table 1 to the letter, "
                f"ts = 100 µs: at {within_letter}, the greatest {letter.of_bound.max():.2f}, where it locks at "
                f"{speeds[worst_letter] / limit:.3f} ω_lim",
                within == n_speeds,
            ),
            Claim(
                "ω_m3 consistently has the minimum relative error",
                f"its greatest error is the least of the three at {least} of {n_speeds} speeds; of all speeds it is "
                f"{', '.join(f'{100 * e.max():.1f} %' for e in default.greatest)} with ω_m1, ω_m2, ω_m3",
                least == n_speeds,
            ),
        ),
    )
