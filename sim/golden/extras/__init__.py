"""Golden models of extras, one file each: what they must show, from what the core shows without them.

`sim/golden/extras/NAME.py` has two functions. `tables(extra, spec, ticks, updates)` returns the clocks of its strobes
and events by their names. `shown(found, clock, cleared)` returns the columns of its ports in these clocks, where
`found` has these tables, and a program has cleared it in the clock `cleared`.
"""

from collections.abc import Mapping
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.extra import Extra


def _model(extra: Extra) -> ModuleType:
    return import_module(f"{__name__}.{extra.name}")


def tables(spec: TachometerSpec, ticks: Table, updates: Table) -> dict[str, Table]:
    """Return the clocks of strobes and events of all extras, by their names."""
    found: dict[str, Table] = {}
    for extra in spec.extras:
        found |= _model(extra).tables(extra, spec, ticks, updates)
    return found


def shown(
    spec: TachometerSpec, found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int = -1
) -> dict[str, NDArray[Any]]:
    """Return what ports of all extras show in these clocks."""
    columns: dict[str, NDArray[Any]] = {}
    for extra in spec.extras:
        columns |= _model(extra).shown(found, clock, cleared)
    return columns
