"""Velocity loops that are measured: their settings, their greatest usable gain, and a run in gates."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Gains, Motor, Observer
from tachometry.sim.golden.command_generator import Command
from tachometry.sim.golden.control import run_loop
from tachometry.sim.studies.loops.control import Load, Outcome, Setting, Task, in_gates, outcome_of, simulation_of
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.methods.track import in_loop

# k_v in 1/s. Each is a fifth more than the one before.
GAINS = tuple(round(20 * 2 ** (k / 4), 1) for k in range(21))
SOUND = 1.0  # A rms, above 50 Hz
DEVIATION = 0.5  # rad/s

IDEAL = VirtualEncoder(500)
REAL = VirtualEncoder(500, jitter=0.05, nonuniformity=0.1, phase_error_deg=10)
HALF = VirtualEncoder(500, jitter=0.025, nonuniformity=0.05, phase_error_deg=5)
MOTOR = Motor(coulomb=0.005)
TASK = Task(
    motion=parse_motion("ramp:0:39rad/s:300ms+constant:39rad/s:900ms"),
    load=Load(torque=0.2, begin=0.8, seconds=0.2),
    noise=0.005,
)


class Kind(NamedTuple):
    """How the loop is closed."""

    name: str
    method: str
    way: Observer
    options: Mapping[str, str] = {}  # of the method
    shortest: float = 0.0  # s: the shortest tick of the core; with shorter control ticks it keeps this one
    filtered: bool = True  # whether there is a low-pass filter of the velocity


_SILENT = {"bound-decay": "no"}  # updates without a count are no measurements, and would have eq. (22)'s weight
KINDS = (
    Kind("S, synchronised", "s", Observer.SYNCHRONISED),
    Kind("S, conventional", "s", Observer.CONVENTIONAL),
    Kind("M/T, synchronised", "mt", Observer.SYNCHRONISED, _SILENT, 20e-6),
    Kind("M/T, conventional", "mt", Observer.CONVENTIONAL, _SILENT, 20e-6),
    Kind("tracking", "track", Observer.SYNCHRONISED, {"max-speed": "100rad/s"}, 20e-6, filtered=False),
)
# Control ticks in seconds, with the clock, and the tick of a core in words.
TICKS = {
    1e-3: ("48MHz", "1ms"),
    1e-4: ("48MHz", "100us"),
    20e-6: ("48MHz", "20us"),
    1e-6: ("48MHz", "1us"),
    20e-9: ("50MHz", "20ns"),
}


def core(kind: Kind, seconds: float, decoding: int = 4, kv: float = GAINS[0]) -> TachometerSpec:
    """Return the core of a kind, whose tick is a control tick, with an LSB below 2^-6 rad/s."""
    clock, tick = TICKS[seconds]
    if seconds < kind.shortest:
        clock, tick = TICKS[20e-6]
    texts = {"ppr": "500", "clock": clock, "tick": tick, "max-time": "10ms", "decoding": str(decoding)}
    if tick == "20ns":
        texts["frac-bits"] = "24"
    return in_loop(of_texts(kind.method, {**texts, **kind.options}), Fraction(kv))


def setting(kind: Kind, kv: float, seconds: float, encoder: VirtualEncoder, decoding: int = 4) -> Setting:
    """Return the loop with a gain: 39 rad/s, and 0.2 Nm for 0.2 s; as in Fig. 15, k_p = (k_v/2)² and G = 2·k_v."""
    spec, low = core(kind, seconds, decoding, kv), 2 * kv if kind.filtered else float("inf")
    gains = Gains(position=(kv / 2) ** 2, velocity=kv, observer=2 * kv, filter=low, seconds=seconds, way=kind.way)
    return Setting(spec=spec, gains=gains, task=TASK, motor=MOTOR, encoder=encoder, begin=0.5)


def is_usable(outcome: Outcome) -> bool:
    """Return whether nothing is heard or swings: the current stays below its limit, the speed close."""
    return outcome.sound <= SOUND and outcome.limited == 0 and outcome.largest <= DEVIATION


def usable(
    at: Callable[[float], Setting], seeds: Sequence[int], jobs: int | None = None
) -> tuple[float, Outcome] | None:
    """Return the greatest of `GAINS` that is usable, and its outcome; None if the least is not.

    It is found by bisection with the first two seeds. From there on gains go down until one is usable with all seeds.
    """
    low, high = -1, len(GAINS)
    while high - low > 1:
        middle = (low + high) // 2
        if is_usable(outcome_of(at(GAINS[middle]), seeds[:2], jobs)):
            low = middle
        else:
            high = middle
    for kv in reversed(GAINS[: low + 1]):
        found = outcome_of(at(kv), seeds, jobs)
        if is_usable(found):
            return kv, found
    return None


def variants(base: Setting) -> Iterator[tuple[str, Setting]]:
    """Yield what a loop depends on that the paper does not say, one thing changed at a time."""
    gains, motor = base.gains, base.motor
    yield "as assumed", base
    yield "k_v on the velocity before the filter", replace(base, gains=replace(gains, on_filtered=False))
    yield "no friction", replace(base, motor=replace(motor, coulomb=0.0))
    yield "friction of 20 mNm", replace(base, motor=replace(motor, coulomb=0.02))
    yield "viscous friction of 0.5 mNm/(rad/s)", replace(base, motor=replace(motor, viscous=5e-4))
    yield "no torque noise", replace(base, task=replace(base.task, noise=0.0))
    yield "ideal disc", replace(base, encoder=IDEAL)
    yield "half the errors of the disc", replace(base, encoder=HALF)
    yield "a delay of half a tick", replace(base, gains=replace(gains, delay=gains.seconds / 2))
    yield "a delay of a tick", replace(base, gains=replace(gains, delay=gains.seconds))
    yield "driver of 1 ms", replace(base, motor=replace(motor, driver_seconds=1e-3))
    yield "inertia 20 % above the controller's", replace(base, motor=replace(motor, inertia=1.2 * motor.inertia))
    yield "current limit of 20 A", replace(base, gains=replace(gains, current_limit=20.0))
    yield "acceleration of the command fed forward", replace(base, gains=replace(gains, feed_forward=True))


class Checked(NamedTuple):
    """A run in gates."""

    ticks: int  # control ticks
    mismatches: int  # clocks, currents, filtered velocities and disturbances that differ from the golden model's
    # gates and double: of this run, and of one with a controller in double precision
    gates: Outcome
    double: Outcome


def check(setting: Setting, seed: int) -> Checked:
    """Run a setting in gates and in double precision."""
    both = in_gates(setting)
    assert both.gates is not None
    log, through = both.through(simulation_of(both.gates), seed)
    n_ticks = len(range(both.gates.latency.first_tick, through.trace.n_clocks, both.gates.period))
    commands = [Command(*row) for row in through.commands[:n_ticks].tolist()]
    expected = run_loop(both.gates, through.trace, commands, golden.tables).tables["current_valid"]
    columns = (expected.clock, expected.current, expected.filtered_velocity, expected.disturbance)
    wanted = np.stack(columns, axis=1)
    if wanted.shape != through.currents.shape:
        wrong = abs(len(wanted) - len(through.currents)) * len(columns)
    else:
        wrong = int(np.count_nonzero(wanted != through.currents))
    double = setting.outcome(setting.run(simulation_of(setting.spec), seed))
    return Checked(n_ticks, wrong, both.outcome(log), double)
