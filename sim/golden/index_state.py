"""The golden index of lines: taken in one state of them, met twice, or passed by."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.recording import packed
from tachometry.spec import TachometerSpec
from tachometry.spec.core.sensors import packed_levels


def in_state(spec: TachometerSpec, levels: Sequence[NDArray[np.uint8]]) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Return Z in the state in which it is taken, and where it has been high since the lines left the state on the
    other side; shape (n,).

    - `levels`, shape (n,): Of the lines as they are on the pins, and of Z as it should be read, at each change.
    """
    *lines, z = levels
    kind, state = spec.encoder.kind, spec.front_end.index_state
    assert state is not None
    place = packed(
        [line ^ np.uint8(name in spec.encoder.inverted) for name, line in zip(kind.lines, lines, strict=True)]
    )
    here = place == packed_levels(state)
    after = (place == packed_levels(kind.after(state))) & (len(lines) > 1)
    again = np.zeros(len(z), dtype=np.bool_)
    left = -1  # the row in which the state was left
    for row in np.flatnonzero(np.diff(here, prepend=here[:1])).tolist():
        if not here[row]:
            left = row
        elif left >= 0 and z[left : row + 1].all():
            again[row] = len(lines) == 1 or after[left] != after[row - 1]
    return z & here, again


def passed_by(
    stepped: NDArray[np.int64],
    step: NDArray[np.int64],
    clock: NDArray[np.int64],
    z: NDArray[np.uint8],
    taken: NDArray[np.uint8],
) -> NDArray[np.int64]:
    """Return clocks of the steps with which it is told that Z has come and gone without its state.

    Times of Z with no step between them, in a clock in which Z is low as in the one before, are one.

    - `stepped`, `step`, shape (m,): Clocks of the steps, and the steps, −1 or +1.
    - `z`, `taken`, shape (n,): From each clock on Z, and Z in its state.
    """
    change = np.diff(z.astype(np.int8))
    comes, goes = clock[1:][change > 0], clock[1:][change < 0]
    goes = goes[np.searchsorted(goes, comes[:1], side="right")[0] if len(comes) else len(goes) :]
    comes_again = np.append(comes[1:], np.iinfo(np.int64).max)[: len(goes)]
    after = np.searchsorted(stepped, goes, side="right")  # the step that would end it
    ends = np.append(stepped, np.iinfo(np.int64).max)[after] < comes_again
    after, gone = after[ends], goes[ends]
    came = comes[np.append(0, np.flatnonzero(ends) + 1)[: len(gone)]]
    meets = clock[1:][np.diff(taken.astype(np.int8)) > 0]
    met = np.searchsorted(meets, gone) > np.searchsorted(meets, came)
    way = np.append(1, step)
    same = (way[np.searchsorted(stepped, came, side="right")] == way[after]) & (way[after] == way[after + 1])
    return stepped[after[~met & same]]
