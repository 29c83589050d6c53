"""Captures become runs: edges that pass in one direction, none missing between them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tachometry.sim.golden.front_end import counted
from tachometry.sim.signals.arrays import Bools, Floats, Ints
from tachometry.sim.signals.recording import Recording, packed
from tachometry.spec import TachometerSpec
from tachometry.spec.core.sensors import packed_levels

LEAST_TURNS = 4  # of a run


@dataclass(frozen=True)
class Run:
    """Edges that pass one after the other in one direction; edge e lies between positions e - 1 and e."""

    time: Floats  # seconds
    first: int  # the edge that passes first
    direction: int = 1  # or -1
    origin: int = 0  # runs of one origin are counted from one edge 0

    @property
    def edge(self) -> Ints:
        """The edges, which go on over the turns."""
        return self.first + self.direction * np.arange(len(self.time))


def runs_of(recording: Recording, spec: TachometerSpec, number: int = 0) -> tuple[list[Run], int, int | None]:
    """Return the runs of a capture that are long enough, how often counts were lost, and the position of the index.

    Without an index, losses are seen where both lines change, and `number` tells the origins of captures apart. It
    raises ValueError if an index is expected, and does not come once a turn.
    """
    if recording.source is not None and {"count", "angle"} & recording.source.lines.keys():
        raise ValueError("must have the edges of the lines: --count and --angle show no disc")
    encoder, n = spec.encoder, spec.encoder.encoder_counts
    step, wrong = counted(encoder, recording.lines)
    position, row, cycle = np.cumsum(step), np.flatnonzero(step), _cycle(spec)
    if cycle:  # a change of both lines is half a cycle
        position = start_of(recording, spec) + np.cumsum(step + 2 * wrong)
    piece, lost, slips, place = np.cumsum(wrong, dtype=np.int64)[row], step[row] == 0, int(wrong.sum()), None
    if spec.index is not None:
        marks, at = _marks(recording, spec, step, position)
        if not len(marks):
            raise ValueError("must have an index with --index, and none comes")
        place = int(at[0]) % 4 if cycle else 0
        off = (at - place + n // 2) % n - n // 2  # of the position at each index
        slipped = np.concatenate([[False], np.diff(off) != 0, [False]])  # of turns; the first is before the first index
        if (slips := int(slipped.sum())) > len(marks) / 2:
            apart = int(np.median(np.abs(np.diff(at))))
            raise ValueError(f"must have an index every {n} counts, as --ppr says, not every {apart}")
        slipped[np.searchsorted(marks, np.flatnonzero(wrong), side="right")] = True
        turn = np.searchsorted(marks, row, side="right")
        piece, lost = np.cumsum(np.diff(slipped, prepend=slipped[0]))[turn], slipped[turn]
        position[row] -= np.append(off[0], off)[turn]
    pieces = _cut(recording.time[row], step[row], position[row], piece + (number << 48), lost)
    runs = [run for run in pieces if len(run.time) > LEAST_TURNS * n]
    return [Run(run.time, run.first, run.direction) for run in runs] if spec.index else runs, slips, place


def start_of(recording: Recording, spec: TachometerSpec) -> int:
    """Return the position at the beginning: place 0 of the cycle of the lines is position 0, if every edge counts."""
    if not (cycle := _cycle(spec)):
        return 0
    place = cycle.index(tuple(int(recording.lines[name][0] ^ (name in spec.encoder.inverted)) for name in "ab"))
    return -place if spec.encoder.reverse else place


def _cycle(spec: TachometerSpec) -> Sequence[tuple[int, ...]]:
    encoder = spec.encoder
    return encoder.kind.cycle if encoder.sensor == "quadrature" and encoder.decoding == 4 else ()


def _marks(recording: Recording, spec: TachometerSpec, step: Ints, position: Ints) -> tuple[Ints, Ints]:
    """Return the rows in which the index is passed, and the position at each.

    An index that is not taken in a state of the lines is that end of Z which comes first forward, in both directions.
    """
    encoder, state = spec.encoder, spec.front_end.index_state
    levels = {name: line ^ np.uint8(name in encoder.inverted) for name, line in recording.lines.items()}
    z = levels["z"].astype(np.int64)
    if state is not None:
        z &= packed([levels[name] for name in encoder.kind.lines]) == packed_levels(state)
        row = np.flatnonzero(np.diff(z, prepend=z[:1]) > 0)
        return row, position[row]
    way = step[np.maximum.accumulate(np.where(step != 0, np.arange(len(step)), 0))]
    change = np.diff(z, prepend=z[:1])
    row = np.flatnonzero((change != 0) & (change == way))
    return row, position[row] - np.minimum(step[row], 0)


def _cut(time: Floats, step: Ints, position: Ints, piece: Ints, lost: Bools) -> Iterator[Run]:
    """Yield the runs between reversals and pieces, without those in which counts were lost."""
    cut = np.flatnonzero((np.diff(step) != 0) | (np.diff(piece) != 0)) + 1
    for begin, end in zip(np.append(0, cut), np.append(cut, len(step)), strict=True):
        if end > begin and not lost[begin]:
            way = int(step[begin])
            yield Run(time[begin:end], int(position[begin]) + (way < 0), way, int(piece[begin]))
