"""Cores of many axes that are mutated, and what is played on them: a motion of its own on every axis."""

from dataclasses import dataclass

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray
from proofs.mutation.cases import Case
from proofs.mutation.stimulus import Stimulus, bursts, noise, steady

from tachometry.hdl import core_of
from tachometry.sim.encoder.stress import stress
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import AxesSpec, Encoder, Speed, STachometer, TachometerSpec, Timing
from tachometry.spec.core.index import Index

_EDGES = 10  # of a motion, at each of its speeds


@dataclass(frozen=True)
class AxesCase(Case):
    """A core of many axes."""

    spec: AxesSpec  # type: ignore[assignment]

    # The arithmetic is that of one axis, and is mutated there.
    selection = "a:src=*hdl/axes/* t:* %i"

    @property
    def group(self) -> str:
        """Which row of the last table."""
        return "axes"

    @property
    def component(self) -> wiring.Component:
        """The core."""
        return core_of(self.spec)

    def play(self, n_clocks: int) -> Stimulus:
        """Return motions, bursts and noise, with resets in the middle."""
        rng = np.random.default_rng(1)
        spec, pins = self.spec, list[NDArray[np.uint64]]()
        traces, starts = list[AxesTrace](), list[int]()
        done = 0
        while done < n_clocks:
            trace = AxesTrace.of([_motion(spec.tachometer, rng, len(traces)) for _ in range(spec.axes)])
            # Some end early: the next reset comes in the middle.
            early = rng.random() < 0.5
            trace = trace.until(int(rng.integers(1, trace.n_clocks)) if early else trace.n_clocks)
            resets = int(rng.choice([1, 1, 2, 5]))
            row = np.searchsorted(trace.clock, np.arange(trace.n_clocks), side="right") - 1
            played = np.zeros(trace.n_clocks, dtype=np.uint64)
            for port, (_, bit) in list(zip(self.pins.inputs, self.pins.places, strict=True))[1:]:
                played |= trace.lines[port.name][row] << np.uint64(bit)
            reset = rng.integers(0, 256, resets).astype(np.uint64) | np.uint64(1)
            starts.append(done + resets)
            pins += [reset, played]
            traces.append(trace)
            done += resets + trace.n_clocks
        return Stimulus(np.concatenate(pins)[:, np.newaxis], traces, starts)


def _motion(spec: TachometerSpec, rng: np.random.Generator, number: int) -> PinTrace:
    kind = rng.integers(4)
    if number % 4 == 0:
        return stress(spec, int(rng.integers(1 << 30)), _EDGES + int(rng.integers(_EDGES)))
    if kind == 0:
        return bursts(spec, rng)
    if kind == 1:
        return steady(spec, rng)
    longest = spec.times.longest_tick * spec.timing.max_ticks
    return noise(spec, rng, int(rng.integers(4, 20 * longest)), 20)


def _case(axes: int, tick_cycles: int, max_ticks: int, mutants: int, *, parallel: bool, index: bool) -> AxesCase:
    timing = Timing(4 * tick_cycles, tick_cycles, max_ticks)
    alone = STachometer(
        encoder=Encoder(1),
        timing=timing,
        # One revolution a second is a count a tick.
        max_speed=Speed.parse("2rev/s"),
        frac_bits=4,
        position_width=8,
        index=Index() if index else None,
    )
    spec = AxesSpec(tachometer=alone, axes=axes, parallel=parallel)
    return AxesCase(f"{axes} axes{', held' * parallel}", spec, mutants)


AXES = [_case(5, 55, 4, 240, parallel=False, index=True), _case(2, 35, 3, 120, parallel=True, index=False)]
