"""Figs. 6, 7 and 8 of Tsuji 2009 show measurement time and resolution of the methods over speed."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from papers.drawing import GOLDEN, reduced
from papers.lab import Lab
from papers.result import Claim, Curve, Panel, Result, percent
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.theory.performance import Performance, m_performance, mt_performance, s_performance, t_performance
from tachometry.sim.theory.tsuji import tsuji_eq14_resolution, tsuji_eq18_resolution, unit_velocity
from tachometry.spec import Encoder, MTachometer, MTTachometer, STachometer, TachometerSpec, Timing, TTachometer

# Table I: 500 pulses per revolution, T_s = 1 ms; Sec. V-B: T_c = 4 ms, 10 ms at most; Sec. VI: mean of 4 ticks.
COUNTS, TICK, MIN_TICKS, MAX_TICKS, AVERAGE = 500, 1e-3, 4, 10, 4
UNIT = float(unit_velocity(COUNTS, TICK))
_SETTINGS = "500 counts per revolution, $T_s$ = 1 ms, $T_c$ = 4 ms, 10 ms at most"
_FASTEST = 50.0  # rad/s
_CORE = {"encoder": Encoder(COUNTS, 1), "timing": Timing.parse("200kHz", "1ms", "10ms"), "frac_bits": 20}
_SPEED = "speed (rad/s)"
_MEAN = f"M, mean of {AVERAGE}"


@dataclass(frozen=True, eq=False)
class _Measured:
    """Holds mean measurement time, s, and greatest error, rad/s, of a golden model at constant speeds."""

    speed: FloatArray
    time: FloatArray
    error: FloatArray


def _measured(lab: Lab, spec: TachometerSpec, seconds: float = 3.0) -> _Measured:
    # Prime to all else: no phase is met twice. Away from the multiples, where updates are forced.
    units = np.concatenate([[0.137, 0.231, 0.367, 0.613, 0.791], np.arange(1, 4) + 0.137, np.arange(1, 4) + 0.387])
    rows = []
    for speed in np.sort(units[units < (1 if spec.method == "t" else np.inf)] * UNIT):
        encoding = lab.turn(spec, f"constant:{float(speed)!r}rad/s:{seconds}s", start_angle_rad=0.001)
        updates = lab.golden(spec, encoding).updates
        settled = updates.clock > 0.1 * spec.timing.clock_hz
        error = np.abs(updates.velocity[settled] * spec.velocity.rad_per_s_per_lsb - speed)
        unit = spec.times.interval_unit / spec.timing.clock_hz
        rows.append((speed, float(np.mean(updates.interval[settled])) * unit, float(np.max(error))))
    return _Measured(*np.array(rows).T)


def _speeds() -> FloatArray:
    """Return up to four counts per tick, the multiples of ω_u among them and the brink of force on either side."""
    brink = np.arange(0, int(_FASTEST / UNIT) + 1)[:, np.newaxis] + np.array([-1, -0.999, 0, 0.999, 1]) / MAX_TICKS
    every = np.concatenate([np.linspace(0.2, _FASTEST, 8000), UNIT * brink.ravel(), [UNIT * (1 - 1e-9)]])
    return np.unique(every[(every > 0.1) & (every <= _FASTEST)])


def _all(speed: FloatArray) -> dict[str, Performance]:
    return {
        "M": m_performance(speed, 1, COUNTS, TICK),
        _MEAN: m_performance(speed, AVERAGE, COUNTS, TICK),
        "T": t_performance(speed, COUNTS, TICK, MAX_TICKS),
        "M/T": mt_performance(speed, MIN_TICKS, COUNTS, TICK, MAX_TICKS),
        "S": s_performance(speed, COUNTS, TICK, MAX_TICKS),
    }


def lattice_mt(**core: Any) -> MTTachometer:
    """Return M/T as in the paper: times in ticks, at least T_c, that is later than T_c less a tick."""
    tick_cycles = core["timing"].tick_cycles
    return MTTachometer(timer="tick", min_time=(MIN_TICKS - 1) * tick_cycles, paper_exact=True, **core)


def _golden(lab: Lab, mt: MTTachometer) -> dict[str, _Measured]:
    """Return the methods whose golden models are measured beside the equations."""
    specs: dict[str, TachometerSpec] = {
        _MEAN: MTachometer(average=AVERAGE, **_CORE),  # type: ignore[arg-type]
        "T": TTachometer(timer="tick", paper_exact=True, **_CORE),  # type: ignore[arg-type]
        "M/T": mt,
        "S": STachometer(**_CORE),  # type: ignore[arg-type]
    }
    return {name: _measured(lab, spec) for name, spec in specs.items()}


def fig06(lab: Lab) -> Result:
    """Compute fig. 6: measurement time on each method."""
    speed = _speeds()
    # Eq. (16) has the exact times of counts: those of a timer that is faster than the tick.
    timer = MTTachometer(min_time=MIN_TICKS * 200, paper_exact=True, **_CORE)  # type: ignore[arg-type]
    theory, golden = _all(speed), _golden(lab, timer)
    ms = 1e3
    curves = [Curve(name, *reduced(speed, ms * method.time)) for name, method in theory.items()]
    curves += [Curve(name + GOLDEN, m.speed, ms * m.time, "dots") for name, m in golden.items()]

    mt, s = ms * theory["M/T"].time, ms * theory["S"].time
    fast = speed > 2 * UNIT
    # T_c and up to one more count: ⌊x⌋ + 1 counts of 1/x T_c.
    spread = float(mt[fast].max() / mt[fast].min() - 1)
    beside = np.abs(speed / UNIT - np.floor(speed / UNIT + 0.5)) < 1 / MAX_TICKS * (1 + 1e-9)
    expected = _all(golden["S"].speed)
    off, off_mt = (float(np.max(np.abs(golden[name].time / expected[name].time - 1))) for name in ("S", "M/T"))
    return Result(
        "Tsuji 2009, Fig. 6",
        "measurement time on each method",
        _SETTINGS,
        (Panel("", _SPEED, "$T_m$ (ms)", tuple(curves), y_limits=(0, 12)),),
        (
            Claim(
                "M measures in every sampling period; averaging makes the time longer",
                f"{ms * TICK:g} ms at all speeds; {ms * theory[_MEAN].time.max():g} ms with the mean of {AVERAGE}",
                bool(np.all(theory["M"].time == TICK)),
            ),
            Claim(
                "M/T: long in the low-speed range, almost constant in the high-speed range",
                f"up to {mt[speed < UNIT / MIN_TICKS].max():.3g} ms below {UNIT / MIN_TICKS:.2f} rad/s; above "
                f"{2 * UNIT:.1f} rad/s from {mt[fast].min():.3g} to {mt[fast].max():.3g} ms ({100 * spread:.1f} %); "
                f"the golden model's mean, with a timer, is off eq. (16) by {100 * off_mt:.2f} % at most",
                bool(mt.max() == MAX_TICKS and spread < 0.15 and off_mt < 0.01),
            ),
            Claim(
                "S: fluctuates; long around multiples of the unit velocity; 10 ms at most",
                f"from {s.min():.3g} to {s.max():.3g} ms; {s[beside].min():.3g} ms within ω_u/{MAX_TICKS} of every "
                f"multiple; the golden model's mean interval is off eq. (20) by {100 * off:.2f} % at most",
                bool(math.isclose(s.min(), 2, rel_tol=1e-3) and np.allclose(s[beside], 10) and off < 0.01),
            ),
        ),
    )


def fig07(lab: Lab) -> Result:
    """Compute fig. 7: measurement resolution on each method."""
    speed = _speeds()
    theory, golden = _all(speed), _golden(lab, lattice_mt(**_CORE))
    curves = [Curve(name, *reduced(speed, method.resolution)) for name, method in theory.items()]
    curves += [Curve(name + GOLDEN, m.speed, m.error, "dots") for name, m in golden.items()]

    t, mt, s = (theory[name].resolution for name in ("T", "M/T", "S"))
    slow = speed < UNIT
    better = slow & (mt < t * (1 - 1e-9))
    low, high = speed[better].min(), speed[better].max()
    # In the same measurement time: eqs. (14) and (18) are equal if the sum is 1, else eq. (18) is less.
    m_s, counted = np.arange(MIN_TICKS, 200), np.arange(1, 100)[:, np.newaxis]
    by_time = tsuji_eq14_resolution(counted, m_s, MIN_TICKS, COUNTS, TICK)
    s_same = tsuji_eq18_resolution(m_s, COUNTS, TICK)
    same = bool(np.all(by_time[0] == s_same) and np.all(by_time[1:] > s_same))
    summed = UNIT / MIN_TICKS
    above = speed > summed
    wins = percent(s[above] < mt[above] * (1 + 1e-9))
    s_golden, m_golden = golden["S"], golden[_MEAN]
    within = s_performance(s_golden.speed, COUNTS, TICK, MAX_TICKS).resolution
    reached = float(np.max(s_golden.error / within))
    fast = speed > 2 * UNIT
    return Result(
        "Tsuji 2009, Fig. 7",
        "measurement resolution on each method",
        _SETTINGS,
        (Panel("", _SPEED, "$Q_V$ (rad/s)", tuple(curves), log="y", y_limits=(0.05, 40)),),
        (
            Claim(
                "M/T is more accurate than T from 3.2 rad/s to 12.5 rad/s",
                f"from {low:.2f} to {high:.2f} rad/s: 2π/(P T_c) and the unit velocity",
                bool(abs(low - 3.2) < 0.1 and abs(high - 12.5) < 0.1),
            ),
            Claim(
                "M/T has large Q_V in the high-speed range",
                f"{mt[fast].max():.3g} rad/s above {speed[fast].min():.3g} rad/s, as the mean of {MIN_TICKS} ticks",
                bool(math.isclose(mt[fast].max(), summed, rel_tol=1e-3)),
            ),
            Claim(
                f"S has an advantage over M/T in the same measurement time above 2π/(P T_c) = {summed:.2f} rad/s",
                f"in the same time at all m_s and sums: {'yes' if same else 'no'}; each in its own time at "
                f"{wins:.0f} % of the speeds from there to {_FASTEST:g} rad/s",
                same,
            ),
            Claim(
                "S achieves small Q_V in all speed ranges",
                f"at most {s.max():.3g} rad/s, ω_u/{UNIT / s.max():.2g}, midway between multiples, {np.median(s):.2g} "
                f"in the median (M {UNIT:.3g}, M/T {np.median(mt):.2g}); largest errors of the golden models: "
                f"{reached:.2f} of Q_V with S, {m_golden.error.max() / summed:.2f} with M",
                bool(s.max() <= UNIT / 2 * (1 + 1e-9) and reached <= 1 and np.median(s) < np.median(mt)),
            ),
        ),
    )


def fig08(lab: Lab) -> Result:
    """Compute fig. 8: performance comparison of M/T method and S method, M/T with a timer."""
    counts, tick, timer, m_c = 81_000, 20e-6, 200e-9, 100
    unit = float(unit_velocity(counts, tick))
    bands, samples = 155, 2000
    units = (np.arange(bands)[:, np.newaxis] + (np.arange(samples) + 0.5) / samples).ravel()
    speed = units * unit
    s, mt = s_performance(speed, counts, tick), mt_performance(speed, m_c, counts, timer)
    s_product, mt_product = s.resolution * s.time, mt.resolution * mt.time
    better = s_product < mt_product
    share = better.reshape(bands, samples).mean(axis=1)
    most = int(np.flatnonzero(share <= 0.5)[-1]) + 1
    first, last = float(speed[better].min()), float(speed[~better].max())
    shown = speed > 1
    product = "$Q_V T_m$ (rad)"
    return Result(
        "Tsuji 2009, Fig. 8",
        "performance comparison of M/T method and S method",
        "81 000 counts per revolution; M/T: timer 200 ns, $T_c$ = 20 µs; S: $T_s$ = 20 µs",
        (
            Panel(
                "",
                _SPEED,
                product,
                (
                    Curve("S", *reduced(speed[shown], s_product[shown], log_x=True)),
                    Curve("M/T", *reduced(speed[shown], mt_product[shown], log_x=True)),
                ),
                log="xy",
            ),
            Panel(
                "share of the speeds between two multiples of the unit velocity at which S is better",
                _SPEED,
                "share",
                (Curve("S better", np.arange(bands) * unit, share, "held"),),
                levels=(0.5,),
                y_limits=(0, 1.05),
            ),
        ),
        (
            Claim(
                "M/T has an advantage in the low-speed range",
                f"at all speeds below {first:.1f} rad/s",
                bool(first > unit / 2),
            ),
            Claim(
                "in the middle-speed range superiority alternates",
                f"from {first:.1f} to {last:.1f} rad/s",
                bool(first < 100 < last),
            ),
            Claim(
                "S has an advantage in the speed range larger than approximately 130 rad/s",
                f"at more than half of the speeds from {most * unit:.1f} rad/s on, at all from {last:.1f} rad/s on",
                bool(abs(most * unit - 130) < unit),
            ),
        ),
    )
