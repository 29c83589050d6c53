"""A control loop without a tachometer: updates, positions and commands that a test makes up."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from support.simulate import clock_by_clock
from tachometry.hdl.control import controller, update_window
from tachometry.hdl.core import loop_core
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.command_generator import Command, Demand, Gains
from tachometry.sim.golden.control import control, run_loop
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run, Table, compare, observed
from tachometry.spec import Encoder, Speed, STachometer, Timing, TrackTachometer
from tachometry.spec.control import LoopSpec
from tachometry.spec.control.form import GAINS, ControlForm
from tachometry.spec.control.ports import GAIN_PORTS

SMALL = LoopSpec(
    tachometer=STachometer(
        encoder=Encoder(500), timing=Timing(1_000_000, 200, 2), frac_bits=8, max_speed=Speed.parse("60rad/s")
    ),
    position_gain=Fraction(9000),
    velocity_gain=Fraction(200),
    observer=Fraction(2000),
    velocity_filter=Fraction(1000),
    control_period=50,
    multiplier="parallel",
)
CONVENTIONAL = replace(SMALL, synchronised=False, velocity_filter=Fraction(3000))
TRACKING = replace(
    SMALL,
    tachometer=TrackTachometer(
        encoder=Encoder(500),
        timing=Timing(1_000_000, 1000, 2),
        frac_bits=8,
        max_speed=Speed.parse("60rad/s"),
        multiplier="block",
    ),
    velocity_filter=None,
)
UNFILTERED = replace(SMALL, velocity_filter=Fraction(0))
SERIAL = replace(SMALL, multiplier="serial", control_period=320)
WITH_INPUTS = replace(SMALL, gains="inputs")
GENERATED = replace(SMALL, command="generator")
USUAL = LoopSpec(
    tachometer=STachometer(
        encoder=Encoder(500), timing=Timing.parse("48MHz", "20us", "10ms"), max_speed=Speed.parse("1000rad/s")
    ),
    velocity_gain=Fraction(80),
    command="generator",
)
OFTEN = replace(USUAL, multiplier="parallel", control_period=96)  # a control tick in 2 µs
COLUMNS = ("current", "saturated", "y", "w")


class Beside(wiring.Component):
    """Window and controller, joined as in the core."""

    def __init__(self, form: ControlForm, multiplier: str) -> None:
        self.window = update_window.UpdateWindow(form)
        self.controller = controller.Controller(form, multiplier)
        commands = ["enable", "position", "command_position", "command_velocity", "command_acceleration"]
        commands += [*GAIN_PORTS.values(), "current_limit"] if form.gain_bits else []
        self.inputs = {name: getattr(self.controller, name).shape() for name in commands}
        super().__init__(
            {
                **{name: In(shape) for name, shape in self.inputs.items()},
                "tick": In(1),
                "update": In(1),
                "measured": In(1),
                "velocity": In(self.window.velocity.shape()),
                "valid": Out(1),
                **{name: Out(getattr(self.controller, name).shape()) for name in COLUMNS},
            }
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.window = window = self.window
        m.submodules.controller = controller = self.controller
        m.d.comb += [
            window.tick.eq(self.tick),
            window.update.eq(self.update),
            window.measured.eq(self.measured),
            window.velocity.eq(self.velocity),
            window.clear.eq(controller.clear),
            window.add.eq(controller.valid),
            window.current.eq(controller.current),
            controller.tick.eq(self.tick),
            *(getattr(controller, name).eq(getattr(window, name)) for name in ("due", "held", "n", "current_sum")),
            *(getattr(controller, name).eq(getattr(self, name)) for name in self.inputs),
            *(getattr(self, name).eq(getattr(controller, name)) for name in ("valid", *COLUMNS)),
        ]
        return m


def made_up(spec: LoopSpec, n_ticks: int, seed: int, less: int) -> tuple[Table, Table, list[dict[str, int]]]:
    """Return updates and control ticks at random, the greatest numbers among them: updates, ticks, inputs by clock.

    All numbers are 2^less times less than they can be.
    """
    rng = np.random.default_rng(seed)
    form, period = spec.form, spec.period
    spacing = np.where(rng.random(n_ticks) < 0.7, spec.latency.least_period, period)
    clock = 5 + np.cumsum(spacing)
    n_clocks = int(clock[-1]) + spec.latency.tick_to_result + 2
    # Often none for longer than the longest measurement, often many between two control ticks.
    rate = np.repeat([0.02, 0.0, 0.5, 0.002], -(-n_clocks // 4))[:n_clocks]
    rate[:5] = 0.9  # before the first control tick
    came = np.flatnonzero(rng.random(n_clocks) < rate)

    def numbers(n: int, most: int) -> Any:
        """Return at random, of any size, and often the greatest."""
        most = max(most >> less, 1)
        size = (most * 2.0 ** -rng.integers(0, 12, n)).astype(np.int64)
        found = rng.integers(-size - 1, size + 2).clip(-most, most)
        return np.where(rng.random(n) < 0.3, rng.choice([-most, most], n), found)

    velocity = numbers(len(came), form.velocity_limit)
    turn = 1 << (form.position_width - 1)
    position = np.cumsum(numbers(n_ticks, 300)) % (2 * turn) - turn
    away = numbers(n_ticks, min(form.most_error * 4, turn * 250))
    wraps = turn << 8
    commands = {
        "position": position,
        "command_position": ((position << 8) + away + wraps) % (2 * wraps) - wraps,
        "command_velocity": numbers(n_ticks, (1 << (form.command_width - 1)) - 1),
        "command_acceleration": numbers(n_ticks, (1 << (form.acceleration_width - 1)) - 1),
        "enable": (rng.random(n_ticks) < 0.95).astype(np.int64),
    }
    gains = random_gains(form, rng, n_ticks) if form.gain_bits else {}
    rows: list[dict[str, int]] = [{"tick": 0, "update": 0} for _ in range(n_clocks)]
    for k, at in enumerate(clock.tolist()):
        rows[at] |= {"tick": 1, **{name: int(column[k]) for name, column in (commands | gains).items()}}
        rows[at + 1] |= {name: int(column[k - 1]) for name, column in commands.items()}  # which is not taken
    commands |= gains
    # Half of what comes is no measurement, for a method that says which ones are.
    forced = (rng.random(len(came)) < 0.5) & spec.tachometer.facts.awaits_count
    for at, value, silent in zip(came.tolist(), velocity.tolist(), forced.tolist(), strict=True):
        rows[at] |= {"update": 1, "velocity": value, "measured": not silent}
    return Table(came, {"velocity": velocity, "forced": forced}), Table(clock, commands), rows


def random_gains(form: ControlForm, rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """Return gains and limits of n control ticks by their ports: those of the options, none, the greatest, and
    others.
    """
    most = {GAIN_PORTS[term]: (form.most_gain, form.reset_gains[term]) for term in GAINS}
    most["current_limit"] = ((1 << form.current_limit.bit_length()) - 1, form.current_limit)
    return {
        name: np.where(
            rng.random(n) < 0.5,
            rng.choice([0, greatest, option], n, p=[0.1, 0.1, 0.8]),
            rng.integers(0, np.minimum(2 * option, greatest) + 1, n),
        )
        for name, (greatest, option) in most.items()
    }


def gains_of(columns: Mapping[str, np.ndarray]) -> list[Gains]:
    """Return the same for the golden model."""
    order = (*GAIN_PORTS.values(), "current_limit")
    return [Gains(*values) for values in zip(*(columns[name].tolist() for name in order), strict=True)]


def check(spec: LoopSpec, n_ticks: int = 300, seed: int = 1, less: int = 0) -> Table:
    """Hold window and controller against the golden model with made-up inputs: what they must show."""
    updates, ticks, rows = made_up(spec, n_ticks, seed, less)
    names = ("command_position", "command_velocity", "command_acceleration", "enable")
    commands = [Command(*values) for values in zip(*(ticks[name].tolist() for name in names), strict=True)]
    gains = gains_of(ticks.columns) if spec.form.gain_bits else None
    wanted = control(spec, ticks.clock, ticks.position, updates, commands, gains)
    seen = clock_by_clock(Beside(spec.form, spec.multiplier), rows, ["valid", *COLUMNS])
    got = [(clock, *(row[name] for name in COLUMNS)) for clock, row in enumerate(seen) if row["valid"]]
    columns = (wanted.clock, *wanted.columns.values())
    assert got == list(zip(*(column.tolist() for column in columns), strict=True))
    return wanted


def random_demands(spec: LoopSpec, rng: np.random.Generator, n: int) -> dict[str, np.ndarray]:
    """Return what a command generator is told in n control ticks, for some of them the same; the greatest numbers among
    it.
    """
    found: dict[str, np.ndarray] = {}
    widths = {port.name: port.width for port in spec.ports if port.name.startswith("generator_")}
    for name, width in widths.items():
        signed = name in ("generator_velocity", "generator_amplitude")
        most, least = (1 << (width - signed)) - 1, -(1 << (width - 1)) if signed else 0
        size = np.exp2(rng.uniform(0, width - signed, n)).astype(np.int64)
        values = rng.integers(-size if signed else np.zeros_like(size), size + 1).clip(least, most)
        found[name] = np.where(rng.random(n) < 0.15, rng.choice([least, most], n), values)
    found["generator_mode"] = rng.integers(0, 4, n)
    # They stay for some ticks, so that a ramp goes on and a sine swings.
    kept = np.maximum.accumulate(np.where(rng.random(n) < 0.15, np.arange(n), 0))
    return {name: values[kept] for name, values in found.items()}


def told(spec: LoopSpec, columns: Mapping[str, np.ndarray]) -> list[Command] | list[Demand]:
    """Return what the golden model is told in each control tick."""
    if spec.command == "generator":
        order = [*(f"generator_{name}" for name in ("mode", "velocity", "acceleration", "amplitude", "rate")), "enable"]
        return [Demand(*values) for values in zip(*(columns[name].tolist() for name in order), strict=True)]
    order = ["command_position", "command_velocity", "command_acceleration", "enable"]
    return [Command(*values) for values in zip(*(columns[name].tolist() for name in order), strict=True)]


Case = tuple[PinTrace, list[Command] | list[Demand], list[Gains] | None, np.ndarray]


def core_case(spec: LoopSpec, seed: int, n_edges: int = 12) -> Case:
    """Return a motion and commands for a core: pins, commands and gains by control tick, rows of a clock and all
    inputs.
    """
    rng = np.random.default_rng(seed)
    trace = stress(spec.tachometer, seed, n_edges)
    clock = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
    n, form = len(clock), spec.form

    def numbers(width: int) -> Any:
        most = (1 << (width - 1)) - 1
        return np.where(rng.random(n) < 0.2, rng.choice([-most, most], n), rng.integers(-most, most + 1, n) >> 8)

    commands = {"enable": (rng.random(n) < 0.95).astype(np.int64)}
    if spec.command == "generator":
        commands |= random_demands(spec, rng, n)
    else:
        commands |= {port.name: numbers(port.width) for port in spec.ports if port.name.startswith("command_")}
        # About the position there, which the golden model need not know.
        commands["command_position"] = np.where(
            rng.random(n) < 0.2, commands["command_position"], rng.integers(-4000, 4000, n)
        )
    taken, gains = commands, None
    if spec.form.gain_bits:
        commands |= random_gains(form, rng, n) | {"freeze": (rng.random(n) < 0.3).astype(np.int64)}
        held = np.maximum.accumulate(np.where(commands["freeze"] == 0, np.arange(n), 0))
        taken = {name: np.where(held | (commands["freeze"] == 0), values[held], 0) for name, values in commands.items()}
        taken["enable"] = commands["enable"]
        gains = gains_of(taken)
    of_tick = told(spec, taken)
    # Commands are there for the clock of the control tick alone, or for the one before, in which they are taken.
    names = [port.name for port in spec.ports.pins]
    at = np.unique(np.concatenate([trace.clock, clock - 1, clock, clock + 1]))
    at = at[at < trace.n_clocks]
    held = np.searchsorted(trace.clock, at, side="right") - 1
    found: dict[str, Any] = {name: line[held] for name, line in trace.lines.items()}
    signed = {port.name for port in spec.ports if port.signed}
    widths = {port.name: port.width for port in spec.ports}
    for name, values in commands.items():
        early = form.gain_bits > 0 and name != "enable"
        tick = np.searchsorted(clock - early, at, side="right") - 1
        there = np.isin(at, clock - early)
        others = ~values[tick] if name in signed else values[tick] ^ ((1 << widths[name]) - 1)
        found[name] = np.where(there, values[tick], others)
    assert form.position_width < 48
    return trace, of_tick, gains, np.stack([at, *(found[name].astype(np.int64) for name in names)], axis=1)


def check_core(spec: LoopSpec, seed: int = 1, n_edges: int = 3) -> Run:
    """Hold a whole core against the golden model: what it must show."""
    trace, commands, gains, changes = core_case(spec, seed, n_edges)
    wanted = run_loop(spec, trace, commands, golden.tables, gains)
    names = [port.name for port in spec.ports.pins]
    rows: list[dict[str, int]] = [{} for _ in range(trace.n_clocks)]
    for clock, *values in changes.tolist():
        rows[clock] = dict(zip(names, values, strict=True))
    seen = clock_by_clock(loop_core.LoopCore(spec), rows, [port.name for port in spec.ports.outputs])
    strobes = list(spec.ports.strobes)
    found = [[clock, *row.values()] for clock, row in enumerate(seen) if any(row[name] for name in strobes)]
    count, first = compare(wanted, observed(spec, trace.n_clocks, np.array(found)))
    assert not count, first
    return wanted
