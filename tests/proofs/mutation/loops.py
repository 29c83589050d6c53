"""Cores with a control loop that are mutated, and what is played on them: a motion, and commands of all sizes.

The motion does not follow from the currents; so speeds, errors and currents come together as in no closed loop.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray
from proofs.mutation.cases import Case
from proofs.mutation.stimulus import Stimulus, bursts, noise, steady

from tachometry.hdl.core.loop_core import LoopCore
from tachometry.sim import golden
from tachometry.sim.encoder.stress import stress
from tachometry.sim.golden.control import Command, run_loop
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.spec import METHODS, Encoder, Speed, Timing
from tachometry.spec.control import LoopSpec

_EDGES = 10  # of a motion, at each of its speeds
_OFTEN = 0.95  # resets within a program, until each clock of it has had one
_COMMANDS = ("command_position", "command_velocity", "command_acceleration", "enable")


@dataclass(frozen=True)
class Commanded:
    """Pins, and a command for each control tick."""

    pins: PinTrace
    commands: Sequence[Command]

    @property
    def n_clocks(self) -> int:
        """Number of clocks to run."""
        return self.pins.n_clocks


@dataclass(frozen=True)
class LoopCase(Case):
    """A core with a control loop."""

    spec: LoopSpec  # type: ignore[assignment]

    # The tachometer is mutated by itself.
    selection = "a:src=*hdl/control/* t:* %i"
    group = "loop"

    @property
    def component(self) -> wiring.Component:
        """The core."""
        return LoopCore(self.spec)

    def right(self, trace: Any) -> Run:
        """Return what the golden models say."""
        return run_loop(self.spec, trace.pins, trace.commands, golden.tables)

    def play(self, n_clocks: int) -> Stimulus:
        """Return motions, bursts and noise, with resets in the middle, and one in each clock of a program."""
        rng = np.random.default_rng(1)
        pins, traces, starts = list[NDArray[np.uint64]](), list[Commanded](), list[int]()
        done = 0
        spec = self.spec
        program = [spec.latency.first_tick + 2 * spec.period + clock for clock in range(spec.period)] * 3
        while done < n_clocks:
            if program and rng.random() < _OFTEN:
                trace, resets = noise(spec.tachometer, rng, program.pop(), 3), 1
            else:
                # Some end early: the next reset comes in the middle.
                trace, resets = self._motion(rng), int(rng.choice([1, 1, 2, 5]))
                trace = trace.until(int(rng.integers(1, trace.n_clocks)) if rng.random() < 0.5 else trace.n_clocks)
            played, commands = self._commanded(trace, rng)
            reset = np.zeros((resets, self.pins.n_words), dtype=np.uint64)
            reset[:, 0] = rng.integers(0, 256, resets).astype(np.uint64) | np.uint64(1)
            starts.append(done + resets)
            pins += [reset, played]
            traces.append(Commanded(trace, commands))
            done += resets + trace.n_clocks
        return Stimulus(np.concatenate(pins), traces, starts)

    def _motion(self, rng: np.random.Generator) -> PinTrace:
        spec = self.spec.tachometer
        kind = rng.integers(5)
        if kind == 0:
            return stress(spec, int(rng.integers(1 << 30)), _EDGES)
        if kind == 1:
            return bursts(spec, rng)
        if kind == 2:
            return steady(spec, rng)
        longest = self.spec.period * (self.spec.units.longest + 3)
        return noise(spec, rng, int(rng.integers(4, 20 * longest)), 20, still=bool(rng.random() < 0.2))

    def _commanded(self, trace: PinTrace, rng: np.random.Generator) -> tuple[NDArray[np.uint64], list[Command]]:
        """Return words of every clock, and the commands that are taken: in all other clocks there are others."""
        spec = self.spec
        clock = np.arange(spec.latency.first_tick, trace.n_clocks, spec.period)
        levels: dict[str, NDArray[np.int64]] = {}
        row = np.searchsorted(trace.clock, np.arange(trace.n_clocks), side="right") - 1
        levels |= {name: line[row].astype(np.int64) for name, line in trace.lines.items()}
        less = int(rng.integers(0, 14))  # so that not all currents are at their limit
        for port in self.pins.inputs:
            if port.name not in _COMMANDS:
                continue
            most = 1 << (port.width - 1)
            if port.name == "enable":
                levels[port.name] = (rng.random(trace.n_clocks) < 0.9).astype(np.int64)
            else:
                of_any_size = rng.integers(-most, most, trace.n_clocks) >> rng.integers(0, less + 1, trace.n_clocks)
                ends = rng.choice([-most, most - 1], trace.n_clocks) >> less
                levels[port.name] = np.where(rng.random(trace.n_clocks) < 0.1, ends, of_any_size)
        taken = zip(*(levels[name][clock].tolist() for name in _COMMANDS), strict=True)
        return self.pins.words(trace.n_clocks, levels), [Command(*command) for command in taken]


class _Short(LoopSpec):
    """The velocity that is held is taken as an update after fewer control ticks than a measurement can take.

    That is so where these would be more than `MAX_INTERVAL`.
    """

    @property
    def longest(self) -> int:
        """The longest interval, as of `LoopSpec.longest`."""
        return 3


_CONVENTIONAL: dict[str, Any] = {
    "method": "m",
    "multiplier": "parallel",
    "synchronised": False,
    "observer": Fraction(2),
    "velocity_filter": Fraction(3),
    "current_width": 10,
}


def _case(
    name: str,
    tick_cycles: int,
    max_ticks: int,
    period: int,
    mutants: int,
    *,
    method: str = "s",
    kind: type[LoopSpec] = LoopSpec,
    **loop: Any,
) -> LoopCase:
    """Return a core with few bits: at most two counts in a tick, and gains near 1."""
    tachometer = METHODS[method](
        encoder=Encoder(1),
        timing=Timing(4 * tick_cycles, tick_cycles, max_ticks),
        # One revolution a second is a count a tick.
        max_speed=Speed.parse("2rev/s"),
        frac_bits=4,
        position_width=8,
    )
    options: dict[str, Any] = {
        "inertia": Fraction(3, 1000),
        "torque_constant": Fraction(60, 1000),
        "position_gain": Fraction(1),
        "velocity_gain": Fraction(1),
        "observer": Fraction(1, 2),
        "velocity_filter": Fraction(3, 4),
        "current_limit": Fraction(1),
        "current_width": 12,
    }
    return LoopCase(f"loop, {name}", kind(tachometer=tachometer, control_period=period, **options | loop), mutants)


LOOPS = [
    # What is held from a control tick to the next is read an odd number of clocks after it: an inverter would be seen.
    _case("serial", 82, 10, 164, 300, velocity_filter=Fraction(0), current_width=13),
    _case("parallel", 26, 12, 52, 160, kind=_Short, method="t", multiplier="parallel"),
    _case("conventional", 52, 2, 52, 120, **_CONVENTIONAL),
    _case("unfiltered", 26, 4, 52, 80, method="t", multiplier="parallel", velocity_filter=Fraction(0)),
]
