"""Figs. 13, 14 and 15 of Tsuji 2009 show velocity loops with a disturbance observer about the core."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from papers.lab import Lab
from papers.result import Claim, Curve, Panel, Result
from tachometry.sim.encoder.motion import FloatArray, cos2pi, parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Gains, Log, Motor, Observer
from tachometry.sim.studies.loops.control import Command, Load, Setting, Task, each_seed, mean
from tachometry.spec import Encoder, MTachometer, MTTachometer, STachometer, TachometerSpec, Timing

_LINES = 500
_MOTOR = Motor(coulomb=0.005)
_ENCODER = VirtualEncoder(_LINES, jitter=0.1, nonuniformity=0.2, phase_error_deg=20)
_NOISE = 0.005  # Nm
_ASSUMED = (
    "500 PPR with 20 °e phase error, disc errors of 0.2 and jitter of 0.1 quarter periods; J = 0.003 kg m², "
    "60.3 mNm/A, 0.1 ms, at most 8 A, friction 5 mNm, torque noise 5 mNm"
)
_TIME, _SPEED = "time (s)", "velocity (rad/s)"
_COUNT = 2 * math.pi / _LINES  # rad, of the figures with single decoding
_KVS = (10.0, 25.0, 50.0, 75.0, 100.0, 150.0)  # 1/s
_FEW_KVS = (10.0, 50.0)


def as_shown(log: Log, rad_per_count: float, rate: float = 30.0, period: float = 1e-3) -> FloatArray:
    """Return the speed by the M method every `period`, low-pass filtered at `rate` rad/s, as in Figs. 13 and 14."""
    every = round(period / (log["time"][1] - log["time"][0]))
    measured = np.diff(log["position"][::every], prepend=0.0) * rad_per_count / period
    kept, found, state = math.exp(-rate * period), [], 0.0
    for value in measured.tolist():
        state = value + (state - value) * kept
        found.append(state)
    return np.array(found)


def _core(method: type[TachometerSpec], *, decoding: int, tick: str, **options: Any) -> TachometerSpec:
    timing = Timing.parse("48MHz", tick, "10ms")
    return method(encoder=Encoder(_LINES, decoding), timing=timing, **options)


def _setting(
    spec: TachometerSpec, task: Task, begin: float, *, kp: float, kv: float, rate: float, synchronised: bool
) -> Setting:
    gains = Gains(
        position=kp,
        velocity=kv,
        observer=rate,
        filter=rate,
        seconds=float(spec.timing.tick_seconds),
        way=Observer.SYNCHRONISED if synchronised else Observer.CONVENTIONAL,
    )
    return Setting(spec=spec, gains=gains, task=task, motor=_MOTOR, encoder=_ENCODER, begin=begin)


def _shown(log: Log) -> Curve:
    shown = as_shown(log, _COUNT)
    return Curve("speed by M, 30 rad/s", np.arange(len(shown)) * 1e-3, shown)


def fig13(lab: Lab) -> Result:
    """Compute fig. 13: PD control with a disturbance observer, by the M method and by the S method."""
    load = Load(torque=0.2, begin=7.0, seconds=0.5)
    motion = parse_motion("ramp:0:40rad/s:5s+constant:40rad/s:5s")
    task = Task(motion=motion, load=load, virtual=True, noise=_NOISE)
    cases: list[tuple[str, type[TachometerSpec], float, float]] = [
        ("M, G = 20 rad/s, $k_v$ = 20", MTachometer, 20.0, 20.0),
        ("M, G = 50 rad/s, $k_v$ = 20", MTachometer, 50.0, 20.0),
        ("S, G = 50 rad/s, $k_v$ = 20", STachometer, 50.0, 20.0),
        ("S, G = 50 rad/s, $k_v$ = 30", STachometer, 50.0, 30.0),
    ]
    panels, sounds, dips = [], [], []
    for title, method, rate, kv in cases:
        spec, synchronised = _core(method, decoding=1, tick="1ms"), method is STachometer
        setting = _setting(spec, task, 5.5, kp=20.0, kv=kv, rate=rate, synchronised=synchronised)
        logs = list(each_seed(setting, lab.seeds))
        found = mean([setting.outcome(log) for log in logs])
        sounds.append(found.sound)
        dips.append(found.dip or 0.0)
        wanted = Curve("command", logs[0]["time"], logs[0]["command"], "reference")
        panels.append(Panel(title, _TIME, _SPEED, (_shown(logs[0]), wanted), y_limits=(0.0, 45.0)))
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


# Of Fig. 14: whether alternate alterations are cancelled, and whether the observer is synchronised.
SOLUTIONS = (
    ("(a) without any technical solutions", False, False),
    ("(b) cancelling out alternate pulse alteration", True, False),
    ("(c) and synchronising the disturbance observer", True, True),
)


def fig14(lab: Lab) -> Result:
    """Compute fig. 14: S without the technical solutions, with alterations cancelled, and synchronised too."""
    motion = parse_motion("ramp:0:39rad/s:5s+constant:39rad/s:10s")
    panels, means = [], []
    limits: dict[str, Any] = {"levels": tuple(_COUNT / 1e-3 * k for k in range(1, 4)), "y_limits": (0.0, 48.0)}
    for title, cancel, synchronised in SOLUTIONS:
        logs = list(each_seed(solution("1ms", motion, cancel, synchronised), lab.seeds))
        means.append(float(np.mean([deviation(log, 8.0) for log in logs])))
        panels.append(Panel(title, _TIME, _SPEED, (_shown(logs[0]),), **limits))
        held = Curve("velocity of the core", logs[0]["time"], logs[0]["held"], "held")
    panels.append(Panel("(d) as (c), without a filter", _TIME, _SPEED, (held,), **limits))
    return Result(
        "Tsuji 2009, Fig. 14",
        "validity of technical solutions",
        f"$T_s$ = 1 ms, x1, $k_p$ = 100, $k_v$ = 30, G = 40 rad/s, 39 rad/s; {_ASSUMED}",
        tuple(panels),
        (
            Claim(
                "the velocity deviates most without any technical solution, less with alternate alterations "
                "cancelled, and least with the observer synchronised: 4.82, 2.36 and 0.52 rad/s",
                f"largest deviations from 8 s on, mean of {len(lab.seeds)} discs: "
                f"{means[0]:.2f}, {means[1]:.2f} and {means[2]:.2f} rad/s",
                means[0] > means[1] > means[2],
            ),
        ),
    )


def solution(tick: str, motion: Command, cancel: bool, synchronised: bool) -> Setting:
    """Return the loop of Fig. 14 with some of the technical solutions."""
    spec, task = _core(STachometer, decoding=1, tick=tick, cancel=cancel), Task(motion=motion, noise=_NOISE)
    return _setting(spec, task, 0.0, kp=100.0, kv=30.0, rate=40.0, synchronised=synchronised)


def deviation(log: Log, begin: float) -> float:
    """Return the largest deviation of the speed as it is shown from the command, from a time on."""
    shown = _shown(log)
    wanted = np.interp(shown.x, log["time"], log["command"])
    return float(np.abs(shown.y - wanted)[shown.x >= begin].max())


@dataclass(frozen=True)
class Cosine:
    """ω = 200/π·(1 − cos(πt/10)), for ten seconds in the paper."""

    duration: float

    def speed(self, t: FloatArray) -> FloatArray:
        """Return in rad/s."""
        return np.asarray(200 / math.pi * (1 - cos2pi(np.asarray(t) / 20)))


def fig15(lab: Lab) -> Result:
    """Compute fig. 15: the RMS of the tracking error over the gain."""
    task = Task(motion=Cosine(10.0 if lab.whole else 4.0), noise=_NOISE)
    kvs = np.array(_KVS if lab.whole else _FEW_KVS)
    mt = _core(MTTachometer, decoding=4, tick="20us", timer="tick", paper_exact=True, min_time=48_000)
    s = _core(STachometer, decoding=4, tick="20us")
    kinds = {"M/T": (mt, False), "S": (s, False), "M/T, synchronised": (mt, True), "S, synchronised": (s, True)}
    found: dict[str, FloatArray] = {}
    for label, (spec, synchronised) in kinds.items():
        rms = []
        for kv in kvs.tolist():
            setting = _setting(spec, task, 0.0, kp=(kv / 2) ** 2, kv=kv, rate=2 * kv, synchronised=synchronised)
            rms.append(mean([setting.outcome(log) for log in each_seed(setting, lab.seeds)]).rms)
        found[label] = np.array(rms)
    mt_rms, s_rms = found["M/T"], found["S, synchronised"]
    low, high = 0, int(np.argmin(np.abs(kvs - 50)))
    return Result(
        "Tsuji 2009, Fig. 15",
        "comparison of RMS of velocity tracking error",
        f"$T_s$ = 20 µs, x4, M/T with $T_c$ = 1 ms, $k_p$ = ($k_v$/2)², G = 2$k_v$, 200/π·(1 − cos(πt/10)) rad/s for "
        f"10 s; {_ASSUMED}",
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
                "S and M/T have almost the same control performance with a low feedback gain",
                f"with k_v = {kvs[low]:g}: {s_rms[low]:.3f} rad/s with S, {mt_rms[low]:.3f} with M/T",
                bool(max(s_rms[low], mt_rms[low]) < 1.25 * min(s_rms[low], mt_rms[low])),
            ),
            Claim(
                "the performance of M/T degrades with a higher feedback gain",
                f"with k_v = {kvs[high]:g}: {s_rms[high]:.3f} rad/s with S, {mt_rms[high]:.3f} with M/T",
                bool(mt_rms[high] > 2 * s_rms[high] and mt_rms[high] > mt_rms[low]),
            ),
            Claim(
                "the minimum RMS of S is smaller",
                f"{s_rms.min():.3f} rad/s with S, {mt_rms.min():.3f} with M/T; {found['M/T, synchronised'].min():.3f} "
                f"with M/T and an observer that is synchronised, {found['S'].min():.3f} with S and one that is not",
                bool(s_rms.min() < mt_rms.min()),
            ),
        ),
    )
