"""Boards that can be simulated."""

# The frequency of each one's oscillator in Hz, at which its core runs.
CLOCKS = {"tang-nano-9k": 27_000_000, "icebreaker": 12_000_000, "ulx3s": 25_000_000}
