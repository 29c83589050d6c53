"""Figs. 13, 14 and 15 of Tsuji 2009: velocity loops with a disturbance observer about the core."""

import math

import numpy as np

from tachometry.sim.encoder.motion import FloatArray, cos2pi, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Gains, LoopSimulation, Motor
from tachometry.sim.figures.lab import Lab
from tachometry.sim.figures.result import Claim, Curve, Panel, Result
from tachometry.sim.studies.control import Task, as_shown, dip, outcome, run
from tachometry.spec import Encoder, MTachometer, MTTachometer, STachometer, TachometerSpec, Timing

_LINES = 500
_LIMIT = 8.0  # A
_MOTOR = Motor(coulomb=0.005, current_limit=_LIMIT)
_ENCODER = VirtualEncoder(_LINES, jitter=0.1, nonuniformity=0.2, phase_error_deg=20)
_NOISE = 0.005  # Nm
_ASSUMED = (
    "500 PPR with 20 °e phase error, disc errors of 0.2 and jitter of 0.1 quarter periods; J = 0.003 kg m², "
    "60.3 mNm/A, 0.1 ms, at most 8 A, friction 5 mNm, torque noise 5 mNm"
)
_SEEDS = range(6)
_TIME, _SPEED, _CURRENT = "time (s)", "velocity (rad/s)", "current (A)"
_LOG = 1e-4  # s


def _core(method: type[TachometerSpec], *, decoding: int, tick: str, **options: object) -> TachometerSpec:
    timing = Timing.parse("48MHz", tick, "10ms")
    return method(encoder=Encoder(_LINES, decoding), timing=timing, **options)  # type: ignore[arg-type]


def _gains(kp: float, kv: float, rate: float, seconds: float, synchronised: bool) -> Gains:
    return Gains(
        position=kp,
        velocity=kv,
        observer=rate,
        filter=rate,
        seconds=seconds,
        synchronised=synchronised,
        current_limit=_LIMIT,
    )


def _shown(label: str, log: dict[str, FloatArray], rad_per_count: float, rate: float) -> Curve:
    shown = as_shown(log, rad_per_count, rate)
    return Curve(label, np.arange(len(shown)) * 1e-3, shown)


def fig13(lab: Lab) -> Result:
    """Fig. 13: PD control with a disturbance observer, by the M method and by the S method."""
    task = Task(
        motion=parse_motion("ramp:0:40rad/s:5s+constant:40rad/s:5s"),
        load=0.2,
        load_from=7.0,
        load_seconds=0.5,
        noise=_NOISE,
    )
    cases: list[tuple[str, type[TachometerSpec], float, float]] = [
        ("M, G = 20 rad/s, k_v = 20", MTachometer, 20.0, 20.0),
        ("M, G = 50 rad/s, k_v = 20", MTachometer, 50.0, 20.0),
        ("S, G = 50 rad/s, k_v = 20", STachometer, 50.0, 20.0),
        ("S, G = 50 rad/s, k_v = 30", STachometer, 50.0, 30.0),
    ]
    methods: tuple[type[TachometerSpec], ...] = (MTachometer, STachometer)
    simulations = {method: LoopSimulation(_core(method, decoding=1, tick="1ms")) for method in methods}
    panels, sounds, dips = [], [], []
    for title, method, rate, kv in cases:
        gains = _gains(20.0, kv, rate, 1e-3, method is STachometer)
        logs = [run(simulations[method], _MOTOR, _ENCODER, gains, task, _LOG, seed) for seed in _SEEDS]
        sounds.append(float(np.mean([outcome(log, 1.0, 5.5).sound for log in logs])))
        dips.append(float(np.mean([dip(log, 7.0, 0.5) for log in logs])))
        curve = _shown("speed by M, 30 rad/s", logs[0], 2 * math.pi / _LINES, 30.0)
        wanted = Curve("command", logs[0]["time"], logs[0]["command"], "reference")
        panels.append(Panel(title, _TIME, _SPEED, (curve, wanted), y_limits=(0.0, 45.0)))
    return Result(
        "Tsuji 2009, Fig. 13",
        "PD control with disturbance observer",
        f"$T_s$ = 1 ms, x1, $k_p$ = 20, 0.2 Nm from 7 to 7.5 s; {_ASSUMED}",
        tuple(panels),
        (
            Claim(
                "with G = 50 rad/s the M method makes a sound noise, the S method does not",
                f"current above 50 Hz: {sounds[1]:.2f} A rms with M, {sounds[2]:.2f} with S",
                sounds[2] < sounds[1] / 3,
            ),
            Claim(
                "the performance of acceleration control improves with the S method, whose G may be higher",
                f"a load of 0.2 Nm changes the speed by {dips[0]:.2f} rad/s with M and G = 20 rad/s, "
                f"by {dips[2]:.2f} with S and G = 50 rad/s",
                dips[2] < dips[0],
            ),
            Claim(
                "an error on velocity control is reduced with higher k_v",
                f"the load changes the speed by {dips[2]:.2f} rad/s with k_v = 20, by {dips[3]:.2f} with 30",
                dips[3] < dips[2],
            ),
        ),
    )


def fig14(lab: Lab) -> Result:
    """Fig. 14: S without the technical solutions, with alternate alterations cancelled, and synchronised too."""
    task = Task(motion=parse_motion("ramp:0:39rad/s:5s+constant:39rad/s:10s"), noise=_NOISE)
    cases = [
        ("(a) without any technical solutions", False, False),
        ("(b) cancelling out alternate pulse alteration", True, False),
        ("(c) and synchronising the disturbance observer", True, True),
    ]
    panels, means = [], []
    held: tuple[FloatArray, FloatArray] = (np.empty(0), np.empty(0))
    for title, cancel, synchronised in cases:
        simulation = LoopSimulation(_core(STachometer, decoding=1, tick="1ms", cancel=cancel))
        gains = _gains(100.0, 30.0, 40.0, 1e-3, synchronised)
        logs = [run(simulation, _MOTOR, _ENCODER, gains, task, _LOG, seed) for seed in _SEEDS]
        means.append(float(np.mean([outcome(log, 2 * math.pi / _LINES, 8.0).shown for log in logs])))
        curve = _shown("speed by M, 30 rad/s", logs[0], 2 * math.pi / _LINES, 30.0)
        panels.append(Panel(title, _TIME, _SPEED, (curve,), levels=_levels(), y_limits=(0.0, 48.0)))
        held = logs[0]["time"], logs[0]["held"]
    panels.append(
        Panel(
            "(d) as (c), without a filter",
            _TIME,
            _SPEED,
            (Curve("velocity of the core", *held, "held"),),
            levels=_levels(),
            y_limits=(0.0, 48.0),
        )
    )
    return Result(
        "Tsuji 2009, Fig. 14",
        "validity of technical solutions",
        f"$T_s$ = 1 ms, x1, $k_p$ = 100, $k_v$ = 30, G = 40 rad/s, 39 rad/s; {_ASSUMED}",
        tuple(panels),
        (
            Claim(
                "the velocity deviates most without any technical solution, less with alternate alterations "
                "cancelled, and least with the observer synchronised: 4.82, 2.36 and 0.52 rad/s",
                f"largest deviations from 8 s on, mean of {len(_SEEDS)} discs: "
                f"{means[0]:.2f}, {means[1]:.2f} and {means[2]:.2f} rad/s",
                means[0] > means[1] > means[2],
            ),
        ),
    )


def _levels() -> tuple[float, ...]:
    unit = 2 * math.pi / _LINES / 1e-3
    return tuple(unit * k for k in range(1, 4))


class _Cosine:
    """ω = 200/π·(1 − cos(πt/10)) for ten seconds."""

    duration = 10.0

    def speed(self, t: FloatArray) -> FloatArray:
        """In rad/s."""
        return np.asarray(200 / math.pi * (1 - cos2pi(np.asarray(t) / 20)))


def fig15(lab: Lab) -> Result:
    """Fig. 15: the RMS of the tracking error over the gain."""
    task = Task(motion=_Cosine(), noise=_NOISE)
    kvs = np.array([25.0, 50.0, 100.0, 150.0, 200.0, 300.0])
    kinds = [
        ("M/T, timer of $T_s$", _core(MTTachometer, decoding=4, tick="20us", timer="tick"), False),
        ("M/T, timer of a clock", _core(MTTachometer, decoding=4, tick="20us"), False),
        ("S", _core(STachometer, decoding=4, tick="20us"), False),
        ("M/T, timer of $T_s$, synchronised", _core(MTTachometer, decoding=4, tick="20us", timer="tick"), True),
        ("S, synchronised", _core(STachometer, decoding=4, tick="20us"), True),
    ]
    found: dict[str, FloatArray] = {}
    for label, spec, synchronised in kinds:
        simulation = LoopSimulation(spec)
        rms = []
        for kv in kvs.tolist():
            gains = _gains((kv / 2) ** 2, kv, 2 * kv, 20e-6, synchronised)
            logs = (run(simulation, _MOTOR, _ENCODER, gains, task, 20e-6, seed) for seed in _SEEDS)
            rms.append(float(np.mean([outcome(log, 1.0).rms for log in logs])))
        found[label] = np.array(rms)
    mt, s, both = found["M/T, timer of $T_s$"], found["S"], found["S, synchronised"]
    return Result(
        "Tsuji 2009, Fig. 15",
        "RMS of the velocity tracking error",
        f"$T_s$ = 20 µs, x4, $k_p$ = ($k_v$/2)², G = 2$k_v$, 200/π·(1 − cos(πt/10)) rad/s for 10 s; {_ASSUMED}",
        (
            Panel(
                "",
                "$k_v$ (1/s)",
                "RMS error (rad/s)",
                tuple(Curve(label, kvs, rms) for label, rms in found.items()),
                log="y",
            ),
        ),
        (
            Claim(
                "S and M/T have almost the same performance with a low gain",
                f"at k_v = {kvs[0]:g}: {mt[0]:.3f} rad/s with M/T, {s[0]:.3f} with S, {both[0]:.3f} with S "
                "synchronised",
                bool(max(mt[0], s[0], both[0]) < 1.5 * min(mt[0], s[0], both[0])),
            ),
            Claim(
                "the minimum RMS of S is smaller than that of M/T",
                f"{both.min():.3f} rad/s with S synchronised, {s.min():.3f} with S and an observer at every tick, "
                f"{mt.min():.3f} with M/T",
                bool(both.min() < mt.min()),
            ),
        ),
    )
