"""Golden standstill says whether nothing has been counted for longer than the maximum time."""

import numpy as np
from numpy.typing import NDArray

from tachometry.sim.signals.run import Table
from tachometry.spec import TachometerSpec


def with_standstill(spec: TachometerSpec, ticks: Table, nominal: NDArray[np.int64], silent: int = 1) -> Table:
    """Return ticks with whether the shaft rests; `nominal` says how many nominal ticks each is long.

    It does if the ticks in a row that counted nothing, this one included, are together long enough. `silent` of them
    came before the first one.
    """
    through = np.cumsum(nominal)
    counted = np.maximum.accumulate(np.where(ticks.pulse_count != 0, through, -silent))
    return ticks.having(standstill=through - counted >= spec.times.standstill_after_ticks)
