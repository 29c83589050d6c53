"""Extras: features of a core beside its measurement, one file each; no other file of the product names them.

`spec/core/extras/NAME.py` states its options and ports, `hdl/extras/NAME.py` builds it, `sim/golden/extras/NAME.py`
predicts it, and `tests/extras/test_NAME.py` checks it. The order is that of options and events and, but for `place`, of
ports and registers.
"""

from tachometry.spec.core.extras.disc import DiscMap
from tachometry.spec.core.extras.electrical import ElectricalAngle
from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.extras.health import Health
from tachometry.spec.core.extras.over_speed import OverSpeed
from tachometry.spec.core.extras.period_offsets import PeriodOffsets
from tachometry.spec.core.extras.position_compare import PositionCompare
from tachometry.spec.core.extras.probe import Probe
from tachometry.spec.core.extras.stream import Stream

EXTRAS: tuple[type[Extra], ...] = (
    Health, OverSpeed, Probe, Stream, PositionCompare, ElectricalAngle, DiscMap, PeriodOffsets,
)  # fmt: skip

__all__ = ["EXTRAS", "Extra"]
