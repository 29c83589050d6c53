"""Cores of many axes and of many options that are mutated, and the motions that are played on them."""

from dataclasses import dataclass

import numpy as np
from amaranth.lib import wiring
from numpy.typing import NDArray
from proofs.mutation.cases import Case
from proofs.mutation.stimulus import Stimulus, bursts, noise, steady

from tachometry.hdl import core_of
from tachometry.sim.encoder.stress import stress
from tachometry.sim.signals.axes import AxesTrace, Trace
from tachometry.sim.signals.recording import PinTrace
from tachometry.spec import AxesSpec, Encoder, Speed, STachometer, TachometerSpec, Timing, of_texts
from tachometry.spec.core.index import Index

_EDGES = 10  # of a motion, at each of its speeds


class MotionCase(Case):
    """A core that is played motions, with resets in the middle."""

    def motion(self, rng: np.random.Generator, number: int) -> Trace:
        """Return the motion of this number."""
        raise NotImplementedError

    def play(self, n_clocks: int) -> Stimulus:
        """Return motions until they have this many clocks."""
        rng = np.random.default_rng(1)
        pins, traces, starts = list[NDArray[np.uint64]](), list[Trace](), list[int]()
        done = 0
        while done < n_clocks:
            trace = self.motion(rng, len(traces))
            # Some end early: the next reset comes in the middle.
            early = rng.random() < 0.5
            trace = trace.until(int(rng.integers(1, trace.n_clocks)) if early else trace.n_clocks)
            resets = int(rng.choice([1, 1, 2, 5]))
            row = np.searchsorted(trace.clock, np.arange(trace.n_clocks), side="right") - 1
            reset = np.zeros((resets, self.pins.n_words), dtype=np.uint64)
            reset[:, 0] = rng.integers(0, 256, resets).astype(np.uint64) | np.uint64(1)
            starts.append(done + resets)
            pins += [reset, self.pins.words(trace.n_clocks, {name: line[row] for name, line in trace.lines.items()})]
            traces.append(trace)
            done += resets + trace.n_clocks
        return Stimulus(np.concatenate(pins), traces, starts)


@dataclass(frozen=True)
class PartCase(MotionCase):
    """A core of one axis, of which only the boxes in these files are mutated."""

    files: tuple[str, ...] = ()

    group = "extras"

    @property
    def selection(self) -> str:  # type: ignore[override]
        """Cells of these files."""
        sources = [f"a:src=*/{file}.py*" for file in self.files]
        return " ".join([*sources, *["%u"] * (len(sources) - 1), "t:* %i"])

    def motion(self, rng: np.random.Generator, number: int) -> Trace:
        """Return edges, illegal transitions and pulses at all inputs."""
        trace = stress(self.spec, int(rng.integers(1 << 30)), _EDGES + int(rng.integers(_EDGES)))
        return trace.completed(self.spec)


@dataclass(frozen=True)
class AxesCase(MotionCase):
    """A core of many axes."""

    spec: AxesSpec  # type: ignore[assignment]

    # The arithmetic is that of one axis, and is mutated there.
    selection = "a:src=*hdl/axes/* t:* %i"
    group = "axes"

    @property
    def component(self) -> wiring.Component:
        """The core."""
        return core_of(self.spec)

    def motion(self, rng: np.random.Generator, number: int) -> Trace:
        """Return a motion of its own for every axis."""
        return AxesTrace.of([_motion(self.spec.tachometer, rng, number) for _ in range(self.spec.axes)])


def _motion(spec: TachometerSpec, rng: np.random.Generator, number: int) -> PinTrace:
    kind = rng.integers(4)
    if number % 4 == 0:
        return stress(spec, int(rng.integers(1 << 30)), _EDGES + int(rng.integers(_EDGES)))
    if kind == 0:
        return bursts(spec, rng)
    if kind == 1:
        return steady(spec, rng)
    longest = spec.tick.longest * spec.timing.max_ticks
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

_TEXTS = {"ppr": "8", "clock": "1MHz", "position-width": "8", "index": "yes", "index-reset": "yes", "preset": "5"}
_FINE = {
    "tick": "1000clk",
    "max-time": "4000clk",
    "position-fine-bits": "3",
    "position-compare": "1.5:1.25:40:3clk:fine",
}
# What has no wrong core in tests/proofs/formal/mutants.json.
EXTRAS = [
    PartCase(
        "m, index in a state",
        of_texts("m", _TEXTS | {"tick": "40us", "max-time": "400us", "index-at": "A=1,B=1"}),
        60,
        files=("index_state", "pin_rise"),
    ),
    PartCase("track, fine compare", of_texts("track", _TEXTS | _FINE), 60, files=("position_compare",)),
]
