"""Blocks of edges that a board records and sends, for `tachometry calibrate --port`."""

import struct

BAUD = 1_000_000
MAGIC = b"EDG"
HEADER = struct.Struct("<3sIH")  # MAGIC, the frequency of the clock in Hz, and how many edges follow
EDGE = 3  # bytes of an edge
LEVELS = 3  # bits of an edge with the levels of A, B and Z; those above are clocks since the edge before
