"""A core as files: Verilog, manifest, and what lies beside them."""

from tachometry.hdl.export.files import export

__all__ = ["export"]
