"""Engines: what runs the hardware. Only this package imports `tachometry.hdl`."""
