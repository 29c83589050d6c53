"""Golden model of `spec.core.extras.over_speed`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.over_speed import OverSpeed


def tables(extra: OverSpeed, view: View) -> dict[str, Table]:
    """Return the clocks of updates beyond the limit."""
    updates = view.tables[view.spec.whole]
    return {"over_speed": Table(updates.clock[np.abs(updates.velocity) > extra.greatest(view.spec)], {})}


def shown(
    extra: OverSpeed, spec: TachometerSpec, found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int
) -> dict[str, NDArray[Any]]:
    """Return whether there has been such an update after `cleared`, and before the clock."""
    beyond = found["over_speed"].clock
    return {"over_speed": np.searchsorted(beyond, clock) > np.searchsorted(beyond, cleared, side="right")}
