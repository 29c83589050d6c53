"""Registers of a core on a bus, and the files that describe them."""
