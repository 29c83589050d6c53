"""The hardware of a spec."""

from functools import singledispatch

from tachometry.hdl.core.axes_tachometer import AxesTachometer
from tachometry.hdl.core.loop_core import LoopCore
from tachometry.hdl.core.tachometer import Tachometer
from tachometry.spec import AxesSpec
from tachometry.spec.control import AnySpec, LoopSpec

AnyTachometer = Tachometer | AxesTachometer | LoopCore


@singledispatch
def core_of(spec: AnySpec) -> AnyTachometer:
    """Return the whole core, for one axis or for many, or with a control loop."""
    return Tachometer(spec.tachometer)


core_of.register(AxesSpec, AxesTachometer)
core_of.register(LoopSpec, LoopCore)
