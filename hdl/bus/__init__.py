"""Registers of the core, and the buses on which they are read."""
