"""Golden models of extras, one file each: what they must show, from what the core shows without them.

`sim/golden/extras/NAME.py` has two functions. `tables(extra, view)` returns tables by their names: of each strobe the
clocks in which it is high, with the outputs that are new with it; of each event the clocks in which it is, a clock
before it is shown; and what `shown` needs besides. `shown(extra, spec, found, clock, cleared)` returns columns of the
other outputs in these clocks, where `found` has these tables, and a program has cleared them in the clock `cleared`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.front_end import Steps
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.extra import Extra


@dataclass(frozen=True)
class View:
    """Data of a golden model: pins and steps, and the tables of the core without extras."""

    spec: TachometerSpec
    trace: PinTrace  # with what a program writes in place of inputs, and in fields that are no inputs
    steps: Steps
    tables: Mapping[str, Table]  # by strobes; `measured` has updates as the method makes them
    clears: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, dtype=np.int64))  # when a program clears


def _model(extra: Extra) -> ModuleType:
    return import_module(f"{__name__}.{extra.name}")


def displaced(view: View) -> Steps:
    """Return the steps with what extras give to the method: displacements of their edges, or offsets."""
    steps = view.steps
    for extra in view.spec.extras:
        if extra.displacement(view.spec) is not None or extra.exchanges:
            steps = _model(extra).displaced(extra, replace(view, steps=steps))
    return steps


def tables(view: View) -> dict[str, Table]:
    """Return the tables of all extras, by their names."""
    found: dict[str, Table] = {}
    for extra in view.spec.extras:
        found |= _model(extra).tables(extra, view)
    return found


def shown(
    spec: TachometerSpec, found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int = -1
) -> dict[str, NDArray[Any]]:
    """Return what ports of all extras show in these clocks."""
    columns: dict[str, NDArray[Any]] = {}
    for extra in spec.extras:
        columns |= _model(extra).shown(extra, spec, found, clock, cleared)
    return columns
