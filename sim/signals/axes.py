"""Holds the pins of many encoders, and finds the tables of one of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.arrays import Ints
from tachometry.sim.signals.recording import MAX_TICKS, PinTrace, Recording, check_ticks, merged
from tachometry.sim.signals.run import Run
from tachometry.spec.language.port import TICK, UPDATE
from tachometry.spec.methods.axes import AxesSpec


@dataclass(frozen=True)
class AxesTrace:
    """Holds the levels that the first synchroniser flip-flops of many axes sample, on the core's clock."""

    each: tuple[PinTrace, ...]  # of axis 0, of axis 1 …, with the same lines and as long as each other

    def __post_init__(self) -> None:
        if len({(trace.n_clocks, *trace.lines) for trace in self.each}) != 1:
            raise ValueError("traces of axes must have the same lines, and as many clocks as each other")

    @classmethod
    def of(cls, each: Sequence[PinTrace]) -> AxesTrace:
        """Return traces up to where the last of them ends: where another ends earlier, its levels stay. All have the
        external ticks of the longest.
        """
        longest = max(each, key=lambda trace: trace.n_clocks)
        n_clocks = longest.n_clocks
        if longest.tick_in is None:
            return cls(tuple(replace(trace, n_clocks=n_clocks) for trace in each))
        rises = longest.clock[np.flatnonzero(np.diff(longest.tick_in, prepend=1) == 1)]
        return cls(tuple(replace(trace, n_clocks=n_clocks, tick_in=None).with_tick_in(rises) for trace in each))

    @classmethod
    def placed(cls, recordings: Sequence[Recording], spec: AxesSpec) -> AxesTrace:
        """Return what the pins of a core see of a recording for each axis.

        It raises ValueError if there are too many clocks to be told apart, or more than `MAX_TICKS` ticks, those of all
        axes together.
        """
        for recording in recordings:
            check_ticks(recording.duration, spec.tachometer, MAX_TICKS // spec.axes, f" of each of {spec.axes} axes")
        return cls.of([PinTrace.of(recording, spec.tachometer) for recording in recordings])

    @property
    def n_clocks(self) -> int:
        """Number of clocks to run."""
        return self.each[0].n_clocks

    @cached_property
    def clock(self) -> Ints:
        """Clock edges from which the levels of the same row are sampled."""
        return merged(*(trace.clock for trace in self.each))

    @cached_property
    def lines(self) -> dict[str, NDArray[np.uint64]]:
        """The lines by name, each as a number with a bit for every axis."""
        found = {name: np.zeros(len(self.clock), dtype=np.uint64) for name in self.each[0].lines}
        for axis, trace in enumerate(self.each):
            held = np.searchsorted(trace.clock, self.clock, side="right") - 1
            for name, line in trace.lines.items():
                if name == _SHARED and axis:
                    continue
                found[name] |= line[held].astype(np.uint64) << np.uint64(axis)
        return found

    @property
    def names(self) -> list[tuple[int, str]]:
        """Every line by its axis and its name: those of axis 0, of axis 1 …."""
        return [
            (axis, name) for axis, trace in enumerate(self.each) for name in trace.lines if name != _SHARED or not axis
        ]

    @property
    def levels(self) -> NDArray[np.uint8]:
        """A row of bytes for each clock of `clock`, with a bit for each of `names`, the first lowest."""
        bits = [self.lines[name] >> np.uint64(axis) & np.uint64(1) for axis, name in self.names]
        return np.packbits(np.stack(bits, axis=1).astype(np.uint8), axis=1, bitorder="little")

    def until(self, n_clocks: int) -> AxesTrace:
        """Return the first clocks of the trace."""
        return AxesTrace(tuple(trace.until(n_clocks) for trace in self.each))


_SHARED = "tick_in"  # a line that all axes have together
Trace = PinTrace | AxesTrace


def of_axis(spec: AxesSpec, run: Run, axis: int) -> Run:
    """Return the rows of one axis, with the ports of a core of its own.

    The rows of the strobe of updates are those among the ticks of this axis.
    """
    found = {}
    ticks = run.tables[TICK]
    own = ticks.clock[ticks["axis"] == axis]
    for strobe, names in spec.axis.ports.strobes.items():
        table = run.tables[strobe]
        if strobe == UPDATE:
            chosen = np.isin(table.clock, own)
        else:
            # An error of the external tick is one of all axes.
            whose = table.columns.get("axis" if strobe == TICK else f"{strobe.removesuffix('_valid')}_axis")
            chosen = np.ones(len(table), dtype=bool) if whose is None else whose == axis
        rows = table.rows(chosen)
        found[strobe] = rows
        if spec.parallel:
            found[strobe] = rows.having(**{name: rows[f"{name}_{axis}"] for name in names})
    return Run.of_ports(spec.axis, run.n_clocks, found)
