"""Blocks of edges that a board records and sends, for `tachometry calibrate --port`."""

BAUD = 1_000_000
MAGIC = b"EDG"
HEADER = 9  # bytes: MAGIC, the frequency of the clock in Hz, and how many edges follow
EDGE = 3  # bytes of an edge
LEVELS = 3  # bits of an edge with the levels of A, B and Z; those above are clocks since the edge before


def header(clock_hz: int, edges: int) -> bytes:
    """Return the beginning of a block."""
    return MAGIC + clock_hz.to_bytes(4, "little") + edges.to_bytes(2, "little")
