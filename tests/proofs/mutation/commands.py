"""The command generator, mutated: demands of all sizes, some of which stay, at ticks as close as they may be or not."""

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from numpy.typing import NDArray
from proofs.mutation.cases import Case, Pins
from proofs.mutation.stimulus import Stimulus
from support.control import GENERATED, random_demands

from tachometry.hdl.control.command_generator import CommandGenerator
from tachometry.spec import Port
from tachometry.spec.control.generator import CONSTANT, RAMP, generator_clocks

_NEAR = 0.3  # of the ticks begin a ramp whose bound is near the change that is left
_COMMANDS = ("command_position", "command_velocity", "command_acceleration")


class Shown(wiring.Component):
    """A generator whose commands are shown as they are with a tick, since only then they are read."""

    def __init__(self) -> None:
        self.box = CommandGenerator(GENERATED.generator, GENERATED.multiplier)
        members = self.box.signature.members
        self.names = [name for name in members if members[name].flow == In]
        super().__init__(
            {name: In(members[name].shape) for name in self.names}
            | {name: Out(members[name].shape) for name in _COMMANDS}
        )

    def elaborate(self, platform: object) -> Module:
        m = Module()
        m.submodules.box = self.box
        m.d.comb += [getattr(self.box, name).eq(getattr(self, name)) for name in self.names]
        with m.If(self.tick):
            m.d.sync += [getattr(self, name).eq(getattr(self.box, name)) for name in _COMMANDS]
        return m


@cache
def _shown() -> Shown:
    return Shown()


@dataclass(frozen=True)
class GeneratorCase(Case):
    """The command generator alone."""

    selection = "a:src=*hdl/control/* t:* %i"
    group = "loop"

    @property
    def component(self) -> wiring.Component:
        """The generator."""
        return _shown()

    @property
    def pins(self) -> Pins:
        """Ports of the box."""
        ports: dict[str, list[Port]] = {"input": [Port("rst", "input", 1)], "output": []}
        box = _shown()
        for name, member in box.signature.members.items():
            direction = "input" if member.flow == In else "output"
            ports[direction].append(Port(name, direction, len(getattr(box, name))))
        return Pins(tuple(ports["input"]), tuple(ports["output"]))

    def play(self, n_clocks: int) -> Stimulus:
        """Return ticks and demands, with a reset now and then."""
        rng = np.random.default_rng(1)
        least = generator_clocks(GENERATED.multiplier)
        tick = np.cumsum(least + rng.integers(0, 2, n_clocks // least))
        tick = tick[tick < n_clocks]
        demands = random_demands(GENERATED, rng, len(tick))
        taken = {name.removeprefix("generator_"): values for name, values in demands.items()}
        _near_bounds(rng, taken)
        taken["enable"] = (rng.random(len(tick)) < 0.95).astype(np.int64)
        width = GENERATED.tachometer.position_width
        taken["position"] = rng.integers(0, 1 << width, len(tick))
        levels: dict[str, NDArray[Any]] = {name: np.zeros(n_clocks, dtype=np.int64) for name in taken}
        for name, values in taken.items():
            levels[name][tick] = values
        levels["tick"] = np.isin(np.arange(n_clocks), tick)
        levels["rst"] = rng.random(n_clocks) < 1e-3
        levels["rst"][0] = True
        return Stimulus(self.pins.words(n_clocks, levels), [], [])


def _near_bounds(rng: np.random.Generator, taken: dict[str, NDArray[Any]]) -> None:
    """Some ticks set a velocity, and the next one begins a ramp to another: its bound is the change but for a bit."""
    first = np.flatnonzero(rng.random(len(taken["mode"])) < _NEAR)[:-1]
    first = first[np.diff(first, append=first[-1] + 2) > 1]
    shift = GENERATED.generator.velocity_shift
    change = np.exp2(rng.uniform(0, 32 - shift, len(first))).astype(np.int64)
    velocity = rng.integers(-1 << 30, 1 << 30, len(first))
    taken["mode"][first], taken["mode"][first + 1] = CONSTANT, RAMP
    taken["velocity"][first] = velocity
    taken["velocity"][first + 1] = velocity + np.where(rng.random(len(first)) < 0.5, change, -change)
    taken["acceleration"][first + 1] = (change << shift) ^ (1 << rng.integers(0, 32, len(first)))


COMMANDS: list[Case] = [GeneratorCase("loop, command generator", GENERATED.tachometer, 200)]
