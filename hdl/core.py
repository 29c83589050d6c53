"""The hardware of a spec."""

from tachometry.hdl.axes.axes_tachometer import AxesTachometer
from tachometry.hdl.tachometer import Tachometer
from tachometry.spec import AxesSpec, CoreSpec

AnyTachometer = Tachometer | AxesTachometer


def core_of(spec: CoreSpec) -> AnyTachometer:
    """The whole core, for one axis or for many."""
    return AxesTachometer(spec) if isinstance(spec, AxesSpec) else Tachometer(spec)
