"""Engines run the hardware. Only this package of sim imports `tachometry.hdl`."""
