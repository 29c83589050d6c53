"""Golden model of `spec.core.extras.over_speed`."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.over_speed import OverSpeed


def tables(extra: OverSpeed, spec: TachometerSpec, ticks: Table, updates: Table) -> dict[str, Table]:
    """Return the clocks from which updates beyond the limit are shown."""
    beyond = np.abs(updates.velocity) > extra.greatest(spec)
    return {"over_speed": Table(updates.clock[beyond] + 1, {})}


def shown(found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int) -> dict[str, NDArray[Any]]:
    """Return whether there has been such an update since the clock after `cleared`."""
    trips = found["over_speed"].clock
    before = np.searchsorted(trips, cleared + 1, side="right")
    return {"over_speed": np.searchsorted(trips, clock, side="right") > before}
