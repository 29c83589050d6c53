"""Figs. 5, 9 and 12 of Tsuji 2009 show velocities over time."""

import math

import numpy as np

from papers.lab import Lab
from papers.result import Claim, Curve, Panel, Result
from papers.tsuji_methods import AVERAGE, COUNTS, TICK, UNIT, lattice_mt
from tachometry.sim.encoder.motion import FloatArray
from tachometry.sim.encoder.virtual import Encoding
from tachometry.sim.golden.methods.s import alterations
from tachometry.sim.signals.run import Run
from tachometry.sim.signals.tables import held_velocity
from tachometry.sim.theory.tsuji import tsuji_eq18_resolution
from tachometry.spec import Encoder, MTachometer, STachometer, TachometerSpec, Timing

# The clock is a few times the edge rate at 40 rad/s; ticks and times are the paper's.
_CORE = {"encoder": Encoder(COUNTS, 1), "timing": Timing.parse("40kHz", "1ms", "10ms"), "frac_bits": 16}
_TIME, _VELOCITY = "time (s)", "velocity (rad/s)"


def _multiples(low: float, high: float) -> tuple[float, ...]:
    return tuple(UNIT * k for k in range(math.ceil(low / UNIT), math.floor(high / UNIT) + 1))


def fig05(lab: Lab) -> Result:
    """Compute fig. 5: pulse pattern in simulation."""
    spec = MTachometer(**_CORE)  # type: ignore[arg-type]
    ramp = lab.turn(spec, "ramp:0:40rad/s:2s")
    held = held_velocity(spec, lab.golden(spec, ramp))

    # The same distance from a multiple, and at the end of every window the same phase: the offset alone differs.
    late = (spec.latency.pin_to_count + 1) / spec.timing.clock_hz
    bands, distances, alike, n_ticks = 4, (0.03, 0.25, 0.4, 0.61, 0.9), 0, 0
    shown = []
    for distance in distances:
        patterns = []
        for band in range(bands):
            speed = (band + distance) * UNIT
            encoding = lab.turn(spec, f"constant:{speed!r}rad/s:0.5s", start_angle_rad=0.001 + late * speed)
            patterns.append(lab.golden(spec, encoding).ticks.pulse_count[1:])
        # Pulse numbers other than k and k + 1 would be no occasional pulses on an offset.
        for band, pattern in enumerate(patterns):
            alike += int(np.count_nonzero(pattern - band == patterns[0]))
            n_ticks += len(pattern)
        if distance == 0.25:
            shown = [(band, patterns[band][:60]) for band in (0, 3)]
    zooms = tuple(
        Panel(
            f"pulse numbers at {band + 0.25:g} unit velocities",
            _TIME,
            "$m_e$ (counts)",
            (Curve("pulse number", np.arange(len(m_e)) * TICK, m_e.astype(np.float64), "held"),),
            y_limits=(band - 0.5, band + 1.5),
            whole=True,
        )
        for band, m_e in shown
    )
    return Result(
        "Tsuji 2009, Fig. 5",
        "pulse pattern in simulation",
        "M method without a filter, 500 counts per revolution, $T_s$ = 1 ms, 0 to 40 rad/s in 2 s",
        (
            Panel(
                "",
                _TIME,
                _VELOCITY,
                (
                    Curve("M", held.time, held.velocity_rad_s, "held"),
                    Curve("shaft (true)", held.time, ramp.true_speed(held.time), "reference"),
                ),
                levels=_multiples(0, 45),
            ),
            *zooms,
        ),
        (
            Claim(
                "the patterns of the velocity in a high-speed range are quite similar to those in a low-speed range, "
                "occasional pulses with a certain amount of offset",
                f"pulse numbers at k + {', '.join(f'{d:g}' for d in distances)} unit velocities, k = 0 to {bands - 1}, "
                f"less k: the same in {alike} of {n_ticks} ticks",
                alike == n_ticks,
            ),
        ),
    )


def _held(run: Run, spec: TachometerSpec, instants: FloatArray) -> FloatArray:
    velocity = run.updates.velocity.astype(np.float64) * spec.velocity.rad_per_s_per_lsb
    return velocity[np.searchsorted(run.updates.clock / spec.timing.clock_hz, instants, side="right") - 1]


def _steps(label: str, run: Run, spec: TachometerSpec) -> Curve:
    return Curve(
        label, run.updates.clock / spec.timing.clock_hz, run.updates.velocity * spec.velocity.rad_per_s_per_lsb, "held"
    )


def _rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error * error)))


def fig09(lab: Lab) -> Result:
    """Compute fig. 9: velocity measurement with alternate pulse alteration."""
    m = MTachometer(**_CORE)  # type: ignore[arg-type]
    plain, cancelled = (STachometer(cancel=cancel, **_CORE) for cancel in (False, True))  # type: ignore[arg-type]
    encoding = lab.turn(m, "ramp:12.3rad/s:12.9rad/s:1s", vibration="0.5mrad:170Hz", nonuniformity=0.2)
    runs = [lab.golden(spec, encoding) for spec in (m, plain, cancelled)]
    instants = np.arange(0.05, 1, TICK)
    truth = encoding.motion.speed(instants)
    errors = [_rms(_held(run, spec, instants) - truth) for run, spec in zip(runs, (m, plain, cancelled), strict=True)]

    m_e = runs[0].ticks.pulse_count[int(0.05 / TICK) :]
    altered = np.flatnonzero(alterations(m_e))
    altered = altered[altered > 1]
    sign = np.sign(m_e[altered] - m_e[altered - 1])
    opposite = 100 * float(np.mean(sign[1:] != sign[:-1]))
    shaft = Curve("shaft, without vibration (true)", instants, truth, "reference")
    limits = (-2.0, 28.0)
    return Result(
        "Tsuji 2009, Fig. 9",
        "velocity measurement with alternate pulse alteration",
        "12.3 to 12.9 rad/s in 1 s; 500 slots, off by up to 0.2 quarter periods; vibration 0.5 mrad, 170 Hz",
        (
            Panel("M method", _TIME, _VELOCITY, (_steps("M", runs[0], m), shaft), y_limits=limits),
            Panel(
                "(a) S method, eq. (17)",
                _TIME,
                _VELOCITY,
                (_steps("S, eq. (17)", runs[1], plain), shaft),
                y_limits=limits,
            ),
            Panel(
                "(b) S method, eq. (21)",
                _TIME,
                _VELOCITY,
                (_steps("S, eq. (21)", runs[2], cancelled), shaft),
                y_limits=limits,
            ),
        ),
        (
            Claim(
                "the pulse number around the unit velocity irregularly alters from 0 to 2",
                f"from {m_e.min()} to {m_e.max()}: {np.count_nonzero(m_e == 0)} times 0, {np.count_nonzero(m_e == 2)} "
                f"times 2 in {len(m_e)} ticks",
                bool(m_e.min() == 0 and m_e.max() == 2),
            ),
            Claim(
                "positive and negative alterations occur alternately, and are of size 1",
                f"{opposite:.0f} % of {len(sign)} alterations have the sign opposite to the last one; all are of size "
                f"{np.abs(m_e[altered] - 1).max()} from the offset",
                bool(opposite > 50 and np.all(np.abs(m_e[altered] - 1) == 1)),
            ),
            Claim(
                "with the modification the oscillation practically disappears",
                f"RMS error {errors[1]:.2f} rad/s with eq. (17), {errors[2]:.2f} rad/s with eq. (21) "
                f"(M {errors[0]:.2f} rad/s)",
                bool(errors[2] < errors[1] / 10),
            ),
        ),
    )


def fig12(lab: Lab) -> Result:
    """Compute fig. 12: velocity measurement on each method; hardware and golden models in lockstep."""
    specs = _methods()
    encoding = lab.turn(next(iter(specs.values())), "ramp:0:40rad/s:1s+constant:40rad/s:200ms+ramp:40rad/s:0:800ms")
    duration = encoding.recording.duration
    instants = np.arange(0.02, duration - TICK / 2, TICK)
    truth = encoding.true_speed(instants)
    slow, fast = truth < UNIT / 4, truth > 2 * UNIT
    curves, runs = {}, {}
    for name, spec in specs.items():
        runs[name] = lab.lockstep(spec, encoding)
        curves[name] = _steps(name, runs[name], spec)
    within, far_within, most = _deviation(runs["S"], specs["S"], encoding)
    panels, rms = [], {}
    for name, curve in curves.items():
        error = curve.y[np.searchsorted(curve.x, instants, side="right") - 1] - truth
        rms[name] = (_rms(error[slow]), _rms(error[fast]))
        panels.append(
            Panel(
                f"{name} method" + (f", mean of {AVERAGE}" if name == "M" else ""),
                _TIME,
                _VELOCITY,
                (curve, Curve("shaft (true)", instants, truth, "reference")),
                levels=_multiples(0, 45),
                y_limits=(-2, 45),
            )
        )

    def told(name: str) -> str:
        return f"RMS error {rms[name][0]:.2f} rad/s below {UNIT / 4:.2f} rad/s, {rms[name][1]:.2f} above {2 * UNIT:.1f}"

    return Result(
        "Tsuji 2009, Fig. 12",
        "velocity measurement on each method",
        "500 counts per revolution, $T_s$ = 1 ms, $T_c$ = 4 ms, 10 ms at most; constant force, none, force against",
        tuple(panels),
        (
            Claim("M: the resolution is constant and large", told("M"), bool(0.5 < rms["M"][1] / rms["M"][0] < 2)),
            Claim(
                "M/T: high resolution in the low-speed range, low in the high-speed range",
                told("M/T"),
                bool(rms["M/T"][0] < rms["M"][0] / 2 and rms["M/T"][1] > rms["M"][1] / 2),
            ),
            Claim("S: high resolution in all speed ranges", told("S"), bool(max(rms["S"]) < rms["M"][1] / 2)),
            Claim(
                "the deviation of S depends on the velocity and corresponds to Fig. 7",
                f"updates less mean speeds over their windows: within Q_V, eq. (18), in {100 * within:.1f} %, in all "
                f"farther than ω_u/8 from a multiple; at most {most[0]:.2f} rad/s within ω_u/8 of a multiple, "
                f"{most[1]:.2f} within ω_u/8 of the middle between two",
                bool(far_within and within > 0.95 and most[1] > 2 * most[0]),
            ),
        ),
    )


def _methods() -> dict[str, TachometerSpec]:
    return {
        "M": MTachometer(average=AVERAGE, **_CORE),  # type: ignore[arg-type]
        "M/T": lattice_mt(**_CORE),
        "S": STachometer(**_CORE),  # type: ignore[arg-type]
    }


def _deviation(run: Run, spec: TachometerSpec, encoding: Encoding) -> tuple[float, bool, tuple[float, float]]:
    """Return errors of alterations' updates against the mean speeds over their windows.

    Returns
    -------
    within : float
        Share of errors within Q_V of eq. (18).
    far_within : bool
        Whether all are, of speeds farther than ω_u/8 from a multiple of ω_u.
    most : pair of float, rad/s
        Greatest error within ω_u/8 of a multiple, and within ω_u/8 of the middle between two.
    """
    updates, clock_hz = run.updates, spec.timing.clock_hz
    chosen = np.flatnonzero(~updates.forced & (updates.interval > 1))[1:]
    end = (
        updates.clock[chosen] - spec.latency.tick_to_velocity - spec.latency.tick - spec.latency.pin_to_count
    ).astype(np.float64)
    begin = end - updates.interval[chosen] * spec.timing.tick_cycles
    motion = encoding.motion
    mean = (motion.angle(end / clock_hz) - motion.angle(begin / clock_hz)) / (end - begin) * clock_hz
    error = np.abs(updates.velocity[chosen] * spec.velocity.rad_per_s_per_lsb - mean)
    within = error <= tsuji_eq18_resolution(updates.interval[chosen], COUNTS, TICK)
    distance = np.abs(mean / UNIT - np.floor(mean / UNIT + 0.5))
    near, middle = distance < 1 / 8, distance > 3 / 8
    return float(np.mean(within)), bool(np.all(within[~near])), (float(error[near].max()), float(error[middle].max()))
