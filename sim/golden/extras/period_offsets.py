"""Golden model of `spec.core.extras.period_offsets`."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.golden.extras import View
from tachometry.sim.golden.front_end import Steps
from tachometry.sim.golden.sorted_lookup import Ints
from tachometry.sim.signals.arrays import wrapped
from tachometry.sim.signals.recording import PinTrace
from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.extras.period_offsets import PeriodOffsets
from tachometry.spec.formats.tracking_sampled import OFFSET_BITS


def displaced(extra: PeriodOffsets, view: View) -> Steps:
    """Return the steps with the pins by which a program reads and writes offsets."""
    assert view.steps.reads is not None
    return replace(view.steps, reads=replace(view.steps.reads, exchange=partial(_exchanged, view.trace)))


def _exchanged(pins: PinTrace, tick: Ints) -> tuple[Ints, Ints]:
    """Return the offset that is read in each tick, and 16 times the one that is written, twice its number, and 1; or 0.

    A write before the first tick waits for the second.
    """
    latest = np.searchsorted(pins.high("period_write"), tick) * (tick > tick[:1].sum())
    word = wrapped(pins.line_at("period_data", tick), OFFSET_BITS)
    written = (16 * word + 2 * pins.line_at("period_address", tick) + 1) * (np.diff(latest, prepend=0) > 0)
    return pins.line_at("period_address", tick + 1), written


def tables(extra: PeriodOffsets, view: View) -> dict[str, Table]:
    """Return the offsets that were asked for in each tick, from the clock on in which they are shown."""
    measured = view.tables["measured"]
    return {"period_offsets": Table(measured.cause + 2, {"offset": measured.offset})}


def shown(
    extra: PeriodOffsets, spec: TachometerSpec, found: Mapping[str, Table], clock: NDArray[np.int64], cleared: int
) -> dict[str, NDArray[Any]]:
    """Return the latest of these."""
    return {"period_offset": found["period_offsets"].at("offset", clock)}
