"""Boards without hardware: the demo in the compiled engine, behind a serial port."""
