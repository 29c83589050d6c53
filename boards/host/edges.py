"""Edges that a board with `EdgeRecorder` has recorded come over a serial port, in blocks."""

import time

from tachometry.boards.host.link import NoAnswer, Port
from tachometry.spec.registers.edges import EDGE, HEADER, LEVELS, MAGIC


def read_edges(port: Port, timeout: float = 60.0) -> tuple[int, list[tuple[int, int]]]:
    """Ask for a block; return the frequency of the clock, and of each edge the clocks since the one before and levels.

    It raises NoAnswer if the block has not come within `timeout` seconds, as when the shaft stands.
    """
    port.write(b"\0")
    found, end = bytearray(), time.monotonic() + timeout
    while True:
        begin = found.find(MAGIC)
        first = begin + HEADER.size
        if begin >= 0 and len(found) >= first:
            _, clock_hz, edges = HEADER.unpack_from(found, begin)
            if len(found) >= (size := first + EDGE * edges):
                break
        if time.monotonic() > end:
            raise NoAnswer(
                f"{len(found)} bytes have come in {timeout:g} s, and no whole block of edges: turn the shaft"
            )
        found += port.read(4096)
    words = [int.from_bytes(found[at : at + EDGE], "little") for at in range(first, size, EDGE)]
    return clock_hz, [(word >> LEVELS, word % (1 << LEVELS)) for word in words]
