"""What is synthesised: Amaranth components, one file a box."""

from tachometry.hdl.core import AnyTachometer, core_of
from tachometry.hdl.export import export
from tachometry.hdl.tachometer import Tachometer

__all__ = ["AnyTachometer", "Tachometer", "core_of", "export"]
