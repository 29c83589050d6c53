"""The golden velocity output turns counts per tick into the unit, the LSB and the width that are wanted."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec
from tachometry.spec.core.ports import BOUNDS
from tachometry.spec.language.port import UPDATE


def in_unit(spec: TachometerSpec, updates: Table) -> Table:
    """Return updates with native velocity and bounds as the output shows them, later by the latency of the output.

    Where 64 bits do not hold the products, Python's integers do.
    """
    output = spec.velocity.output
    if output is None:
        return updates

    kind = np.int64 if output.max_native.bit_length() + output.multiplier.bit_length() < 62 else object

    def scaled(native: NDArray[np.int64], towards: int = 0) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        wide = (native.astype(kind) * output.multiplier + output.rounding(towards)) >> output.shift
        held = np.clip(wide, -output.limit, output.limit)
        return held.astype(np.int64), (held != wide).astype(bool)

    velocity, overflow = scaled(updates.velocity)
    bounds = {name: scaled(updates[name], towards)[0] for name, towards in BOUNDS.items() if spec.bounds}
    bounds |= {name: scaled(updates[name])[0] for name in ("velocity_smooth",) if name in updates.columns}
    clock = updates.clock + spec.latency.output
    return updates.having(clock=clock, velocity=velocity, velocity_overflow=overflow, **bounds)


def with_whole(spec: TachometerSpec, updates: Table) -> dict[str, Table]:
    """Return updates by their strobes, each with all columns: that of the velocity, and `whole`."""
    later = spec.latency.tick_to_update - spec.latency.tick_to_velocity
    return {UPDATE: updates} | ({spec.whole: updates.having(clock=updates.clock + later)} if spec.latency.rest else {})


def with_age(spec: TachometerSpec, ticks: Table, updates: Table) -> Table:
    """Return ticks with the age of the velocity: the ticks after the cause of its update, or from reset on."""
    if not spec.age:
        return ticks
    cause = np.append(-1, updates.cause)[np.searchsorted(updates.clock, ticks.clock, side="right")]
    age = np.arange(1, len(ticks.clock) + 1) - np.searchsorted(ticks.clock, cause, side="right")
    return ticks.having(age=np.minimum(age, spec.timing.max_ticks))
