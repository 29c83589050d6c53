"""The hardware of a spec."""

from collections.abc import Callable
from typing import Any

from tachometry.hdl.core.axes_tachometer import AxesTachometer
from tachometry.hdl.core.loop_core import LoopCore
from tachometry.hdl.core.sampled_tachometer import tachometer_of
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.spec.control import AnySpec

AnyTachometer = Tachometer | AxesTachometer | LoopCore
_CORES: dict[str, Callable[[Any], AnyTachometer]] = {"one": tachometer_of, "axes": AxesTachometer, "loop": LoopCore}


def core_of(spec: AnySpec) -> AnyTachometer:
    """Return the whole core, for one axis or for many, or with a control loop."""
    return _CORES[spec.kind](spec)
