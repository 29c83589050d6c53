"""Velocity loops that are measured: their settings, their greatest usable gain, and a run in gates."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from pages import data

from tachometry.sim import golden
from tachometry.sim.encoder.motion import parse_motion
from tachometry.sim.encoder.virtual import VirtualEncoder
from tachometry.sim.engines.loop import Gains, Motor, Observer
from tachometry.sim.golden.command_generator import Command
from tachometry.sim.golden.control import run_loop
from tachometry.sim.studies.loops.control import Load, Outcome, Setting, Task, in_gates, outcome_of, simulation_of
from tachometry.spec import TachometerSpec, of_texts
from tachometry.spec.methods.track import in_loop

_DATA = data("loops")
# k_v in 1/s. Each is a fifth more than the one before.
GAINS = tuple(round(20 * 2 ** (k / 4), 1) for k in range(21))
SOUND = 1.0  # A rms, above 50 Hz
DEVIATION = 0.5  # rad/s

DISCS = {name: VirtualEncoder(500, **faults) for name, faults in _DATA["discs"].items()}
IDEAL, REAL, _ = DISCS.values()
MOTOR = Motor(coulomb=0.005)
TASK = Task(
    motion=parse_motion("ramp:0:39rad/s:300ms+constant:39rad/s:900ms"),
    load=Load(torque=0.2, begin=0.8, seconds=0.2),
    noise=0.005,
)


class Kind(NamedTuple):
    """How the loop is closed; loops.toml explains the fields."""

    name: str
    method: str
    way: Observer
    options: Mapping[str, str] = {}  # of the method
    shortest: float = 0.0
    filtered: bool = True  # whether there is a low-pass filter of the velocity


KINDS = tuple(Kind(**{**each, "way": Observer[each["way"]]}) for each in _DATA["kind"])
TICKS: dict[float, list[str]] = {float(seconds): words for seconds, words in _DATA["ticks"].items()}


def core(kind: Kind, seconds: float, decoding: int = 4, kv: float = GAINS[0]) -> TachometerSpec:
    """Return the core of a kind, whose tick is a control tick, with an LSB below 2^-6 rad/s."""
    clock, tick, _ = TICKS[max(seconds, kind.shortest)]
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
    for name, changed in _DATA["variants"].items():
        encoder, delay = DISCS[changed.get("disc", "real")], changed.get("ticks", 0) * base.gains.seconds
        parts: dict[str, Any] = {part: changed.get(part, {}) for part in ("gains", "motor", "task")}
        parts["gains"] = {"delay": delay or base.gains.delay, **parts["gains"]}
        yield name, replace(base, encoder=encoder, **{p: replace(getattr(base, p), **v) for p, v in parts.items()})


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
