"""What is synthesised: Amaranth components, one file a box."""

from tachometry.hdl.export import export
from tachometry.hdl.tachometer import Tachometer

__all__ = ["Tachometer", "export"]
