"""Amaranth components are synthesised, one file a box."""

from tachometry.hdl.core.core import AnyTachometer, core_of
from tachometry.hdl.core.tachometer import Tachometer

__all__ = ["AnyTachometer", "Tachometer", "core_of"]
