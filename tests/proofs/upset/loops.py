"""Upsets of a core with a control loop, at commands that do not follow from its currents.

So nothing but its own rules makes the loop forget. y forgets with each update of the velocity. z does not while there
are currents, as a disturbance observer integrates what it commands; in a loop the motor answers for it. It forgets
while the current is not enabled.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from proofs.upset.campaign import Campaign, motion, play
from proofs.upset.simulate import Upsettable

from tachometry.sim import golden
from tachometry.sim.golden.control import Command, control
from tachometry.sim.golden.front_end import count, decoded
from tachometry.sim.signals.recording import PinTrace, merged
from tachometry.sim.signals.run import Table
from tachometry.spec import Encoder, Speed, STachometer, Timing
from tachometry.spec.control import LoopSpec
from tachometry.spec.language.port import UPDATE

_CYCLES = 60  # of a motion
_COMMANDS = ("command_position", "command_velocity", "command_acceleration", "enable")
_COMPARED = ("control_tick", "current_valid", "current", "current_saturated", "filtered_velocity", "disturbance")
_WORKS = 60  # control ticks for which the current is enabled


SPEC = LoopSpec(
    tachometer=STachometer(encoder=Encoder(500), timing=Timing(5_000_000, 100, 20), max_speed=Speed.parse("75rev/s")),
    inertia=Fraction(1, 100_000),
    position_gain=Fraction(1_000_000),
    velocity_gain=Fraction(2000),
    observer=Fraction(25_000),
    velocity_filter=Fraction(20_000),
    control_period=100,
    multiplier="parallel",
)


LOOPS = {
    "loop": SPEC,
    "loop, serial": replace(SPEC, multiplier="serial", control_period=200),
    "loop, conventional": replace(SPEC, synchronised=False),
}


@dataclass(frozen=True)
class CommandedTrace:
    """Pins and commands on the core's clock; the lines are numbers."""

    clock: NDArray[np.int64]
    lines: dict[str, NDArray[np.uint64]]
    n_clocks: int
    pins: PinTrace
    commands: dict[str, NDArray[np.int64]]  # with the clock from which each is there as `clock`

    def command(self, clock: NDArray[np.int64]) -> Sequence[Command]:
        """Return the commands in these clocks."""
        row = np.searchsorted(self.commands["clock"], clock, side="right") - 1
        rows = zip(*(self.commands[name][row].tolist() for name in _COMMANDS), strict=True)
        return [Command(*command) for command in rows]


def _forgets(spec: LoopSpec) -> int:
    """Return control ticks without a current after which less than half a unit is left of the greatest number of w.

    e^(−G·t) is left of y and of z, and once more as one drives the other.
    """
    slower = min(spec.observer, spec.filter or spec.observer)
    return math.ceil(2 * math.log(2 * spec.form.most_w) / float(slower * spec.units.seconds)) + spec.units.longest


def _trace(spec: LoopSpec, seed: int) -> CommandedTrace:
    """Return a motion, and new commands every few control ticks."""
    rng = np.random.default_rng(seed)
    pins = motion(spec.tachometer, _CYCLES, seed)
    at = np.arange(0, pins.n_clocks, spec.period)
    n, few = len(at), 5
    works = np.arange(n) % (_WORKS + _forgets(spec) + 2) < _WORKS
    commands = {"clock": at, "enable": works.astype(np.int64)}
    # About the position, and so near that not all currents are at their limit.
    shown, _ = count(spec.tachometer, decoded(spec.tachometer, pins), at)
    position = shown.position << spec.form.position_bits
    widths = {port.name: port.width for port in spec.ports}
    for name in _COMMANDS[:-1]:
        most = 1 << (widths[name] - 1) if name != "command_position" else 8 << spec.form.position_bits
        values = np.repeat(rng.integers(-most, most, -(-n // few)) >> rng.integers(2, 13, -(-n // few)), few)[:n]
        commands[name] = values + (position if name == "command_position" else 0)
    clock = merged(pins.clock, at)
    lines = {}
    for name, line in pins.lines.items():
        lines[name] = line[np.searchsorted(pins.clock, clock, side="right") - 1].astype(np.uint64)
    row = np.searchsorted(at, clock, side="right") - 1
    for name in _COMMANDS:
        lines[name] = (commands[name][row] & ((1 << widths[name]) - 1)).astype(np.uint64)
    return CommandedTrace(clock, lines, pins.n_clocks, pins, commands)


@dataclass(frozen=True)
class _Right:
    """Holds the outputs of the golden models: the clocks of control ticks, and the rows of `current_valid`."""

    ticks: NDArray[np.int64]
    currents: Table

    @classmethod
    def of(cls, spec: LoopSpec, trace: CommandedTrace, ticks: int, control_ticks: int, away: int) -> "_Right":
        """Return with windows and control ticks of these phases, and a position that is so many counts off."""
        alone = spec.tachometer
        last = np.arange(ticks, trace.n_clocks - alone.latency.tick, alone.tick.longest, dtype=np.int64)
        with patch.object(golden, "windows", lambda *_: (last, np.empty(0, dtype=np.int64))):
            updates = golden.tables(alone, trace.pins)[UPDATE]
        clock = np.arange(control_ticks, trace.n_clocks, spec.period, dtype=np.int64)
        # The position is as late as a tick shows it.
        places, _ = count(alone, decoded(alone, trace.pins), clock - alone.latency.tick)
        return cls(clock, control(spec, clock, places.position + away, updates, trace.command(clock)))

    def dense(self, first: int, n: int) -> NDArray[np.int64]:
        """Return a value for each of these clocks, 0 where nothing strobes."""
        found = np.zeros((n, len(_COMPARED)), dtype=np.int64)
        for place, clock in enumerate((self.ticks, self.currents.clock)):
            found[clock[(clock >= first) & (clock < first + n)] - first, place] = 1
        rows = self.currents.rows((self.currents.clock >= first) & (self.currents.clock < first + n))
        for place, name in enumerate(_COMPARED[2:], 2):
            found[rows.clock - first, place] = rows[name]
        return found


def _allowed(spec: LoopSpec, trace: CommandedTrace) -> NDArray[np.int64]:
    """Return clocks after which all must be right: the tachometer is first, then control ticks come again, and then the
    current has not been enabled for as long as y and z take to forget.
    """
    own = spec.tachometer.recovery.clocks
    assert own is not None
    counters = own + (1 << (spec.period - 1).bit_length()) + 2 * spec.period
    at, enable = trace.commands["clock"], trace.commands["enable"]
    begins = at[1:][(enable[1:] == 0) & (enable[:-1] == 1)]
    clocks = np.arange(trace.n_clocks)
    found = np.append(begins, 2 * trace.n_clocks)[np.searchsorted(begins, clocks + counters)]
    return found + (_forgets(spec) + 2) * spec.period - clocks


def upsets(name: str, n: int, seed: int = 1, only: str = "") -> Campaign:
    """Run a campaign, as `campaign.upsets` does; `name` is one of `LOOPS`."""
    spec = LOOPS[name]
    trace = _trace(spec, seed)
    core = Upsettable(spec, trace)  # type: ignore[arg-type]
    ports = [port.name for port in spec.ports.outputs]
    compared = [ports.index(name) for name in _COMPARED]
    position, tick, control_tick = (ports.index(name) for name in ("position", "tick", "control_tick"))
    expected: dict[tuple[int, int, int], _Right] = {}
    alone = spec.tachometer
    steps = decoded(alone, trace.pins)

    def wrong(clock: int, shown: NDArray[np.int64]) -> NDArray[np.bool_]:
        ticks, controls = (np.flatnonzero(shown[:, place]) for place in (tick, control_tick))
        if not len(ticks) or not len(controls):
            return np.ones(len(shown), dtype=bool)
        last = clock + int(ticks[-1]) - alone.latency.tick
        right_position, _ = count(alone, steps, np.array([last]))
        away = int(shown[ticks[-1], position] - right_position.position[0])
        key = (last % alone.tick.longest, (clock + int(controls[-1])) % spec.period, away)
        if key not in expected:
            expected[key] = _Right.of(spec, trace, *key)
        seen = shown[:, compared]
        seen[:, 2:] *= seen[:, 1:2]
        return (seen != expected[key].dense(clock, len(shown))).any(axis=1)

    return play(name, spec, core, trace, n, _allowed(spec, trace), seed, wrong, only)  # type: ignore[arg-type]
