"""Golden model of `spec.core.extras.electrical.AngleInTurn`, for one axis; its clocks are rounds."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.extras.electrical import counts_of, slopes_at
from tachometry.sim.golden.sorted_lookup import Ints
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.electrical import AngleInTurn
from tachometry.spec.formats.angles import PLACE_BITS, SHOWN_BITS
from tachometry.spec.methods.axis import OneAxis


def tables(extra: AngleInTurn, view: View) -> dict[str, Table]:
    """Return the angle and whether it is valid, for each tick."""
    assert isinstance(view.spec, OneAxis)
    angles, updates, late = extra.angles(view.spec), view.tables["measured"], view.spec.late
    fine_bits, s, cause = angles.position_fine_bits, late + extra.ahead, updates["cause"]
    counted, _ = counts_of(extra, view, 0)
    between = updates["position_fine"] - (view.tables["tick"].at("position", cause) << fine_bits)
    found = list[int]()
    names = ("velocity", "acceleration")
    columns = (counted.at("angle", cause), between, *(updates[name] for name in names))
    for at, place, velocity, acceleration in zip(*(column.tolist() for column in columns), strict=True):
        (mean,) = slopes_at(angles, velocity, acceleration, [(s >> 1) - late])
        begin = at + angles.factors[1].times(wrapped(place, fine_bits + PLACE_BITS)) + mean * s
        found.append((begin >> angles.bits - SHOWN_BITS) + extra.offset)
    known = np.searchsorted(view.steps.index + view.spec.latency.tick, cause, side="right") > 0
    return {"angle_turns": Table(cause, {"angle": np.array(found, np.int64) % (1 << SHOWN_BITS), "known": known})}


def shown(
    extra: AngleInTurn, spec: TachometerSpec, found: Mapping[str, Table], clock: Ints, cleared: int
) -> dict[str, NDArray[Any]]:
    """Return what belongs to these ticks."""
    turns = found["angle_turns"]
    return {"angle": turns.at("angle", clock), "angle_valid": turns.at("known", clock) > 0}
