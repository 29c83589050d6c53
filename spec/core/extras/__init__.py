"""Extras: features of a core beside its measurement, one file each; no other file of the product names them.

`spec/core/extras/NAME.py` states its options and ports, `hdl/extras/NAME.py` builds it, `sim/golden/extras/NAME.py`
predicts it, and `tests/extras/test_NAME.py` checks it. The order is that of options, ports and registers.
"""

from tachometry.spec.core.extras.extra import Extra
from tachometry.spec.core.extras.over_speed import OverSpeed

EXTRAS: tuple[type[Extra], ...] = (OverSpeed,)

__all__ = ["EXTRAS", "Extra"]
