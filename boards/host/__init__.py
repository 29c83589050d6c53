"""Run on the machine that a board is connected to."""
