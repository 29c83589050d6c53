"""Golden velocity output: from counts per tick to the unit, the LSB and the width that are wanted."""

from dataclasses import replace

import numpy as np

from tachometry.sim.results import Updates
from tachometry.spec import TachometerSpec


def in_unit(spec: TachometerSpec, updates: Updates) -> Updates:
    """Updates whose velocity is the native one, with that of the output instead.

    Python's integers carry the products: they have up to 90 bits.
    """
    output = spec.output
    if output is None:
        return updates
    native = updates.velocity.astype(object)
    scaled = (native * output.multiplier + output.half) >> output.shift
    velocity = np.clip(scaled, -output.limit, output.limit)
    return replace(updates, velocity=velocity.astype(np.int64), velocity_overflow=(velocity != scaled).astype(bool))
