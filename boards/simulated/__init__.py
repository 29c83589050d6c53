"""A board without hardware is the demo in the compiled engine, behind a serial port."""
