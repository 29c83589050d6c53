"""Upsets of cores of many axes: state in memories, and rounds that may begin at another clock."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from proofs.upset.campaign import Campaign, motion, play
from proofs.upset.simulate import Upsettable

from tachometry.sim import golden
from tachometry.sim.signals.axes import AxesTrace
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Run
from tachometry.spec import AxesSpec, Encoder, STachometer, Timing
from tachometry.spec.core.index import Index

_CYCLES = 15  # of a motion
_OF_POSITION = ("position", "index_position")  # and what is held of an axis

SPEC = AxesSpec(tachometer=STachometer(encoder=Encoder(500), timing=Timing(5_000_000, 120, 20), index=Index()), axes=3)


def _trace(spec: AxesSpec, seed: int) -> AxesTrace:
    """Return a motion for each axis, and index lines that rise now and then."""
    rng = np.random.default_rng(seed)
    found = []
    for axis in range(spec.axes):
        trace = motion(spec.tachometer, _CYCLES, seed + axis)
        z = (rng.random(len(trace.clock)) < 0.2).astype(np.uint8)
        found.append(replace(trace, z=z))
    # Where one ends the shaft would rest, and forced updates go on at the phase that an upset has left.
    return AxesTrace.of(found).until(min(trace.n_clocks for trace in found))


def _from(trace: PinTrace, clock: int) -> PinTrace:
    """Return the trace from a clock on."""
    row = int(np.searchsorted(trace.clock, clock, side="right")) - 1
    at = np.maximum(trace.clock[row:] - clock, 0)
    lines = {name: line[row:] for name, line in trace.lines.items()}
    return PinTrace.of_lines(at, trace.n_clocks - clock, lines)


def _columns(spec: AxesSpec) -> list[tuple[str, str]]:
    """Return the outputs to compare, each with its strobe."""
    found = [(name, strobe) for strobe, names in spec.ports.strobes.items() for name in (strobe, *names)]
    return [(name, strobe) for name, strobe in found if not name.startswith(_OF_POSITION)]


def _dense(spec: AxesSpec, run: Run, first: int) -> NDArray[np.int64]:
    """Return the outputs in every clock with their strobe, else 0; the run begins in clock `first`."""
    found = np.zeros((first + run.n_clocks, len(_columns(spec))), dtype=np.int64)
    for place, (name, strobe) in enumerate(_columns(spec)):
        table = run.tables[strobe]
        found[first + table.clock, place] = 1 if name == strobe else table[name]
    return found


def upsets(n: int, seed: int = 1, only: str = "") -> Campaign:
    """Run a campaign, as `campaign.upsets` does."""
    spec, trace = SPEC, _trace(SPEC, seed)
    core = Upsettable(spec, trace)
    bound = spec.recovery.clocks
    ports = [port.name for port in spec.ports.outputs]
    columns = [(ports.index(name), ports.index(strobe)) for name, strobe in _columns(spec)]
    compared, strobes = (np.array(places) for places in zip(*columns, strict=True))
    tick, axis = ports.index("tick"), ports.index("axis")
    expected: dict[int, NDArray[np.int64]] = {}

    def wrong(clock: int, shown: NDArray[np.int64]) -> NDArray[np.bool_]:
        phase = 0
        begun = np.flatnonzero(shown[:, tick].astype(bool) & (shown[:, axis] == 0))
        if len(begun):
            phase = int((clock + begun[-1] - spec.tick_clock(0, 0)) % spec.tick.longest)
        if phase not in expected:
            late = AxesTrace(tuple(_from(each, phase) for each in trace.each))
            expected[phase] = _dense(spec, golden.run(spec, late), phase)
        right = expected[phase][clock : clock + len(shown)]
        seen = shown[:, compared] * (shown[:, strobes] != 0)
        return (seen != right).any(axis=1)

    return play("axes", spec, core, trace, n, np.full(trace.n_clocks, bound), seed, wrong, only)
