"""Probe inputs latch where the shaft is at their edges."""

from tachometry.spec.language.option import ParameterError

MOST_PROBES = 8
PROBE_HELP = (
    "N inputs probe, 1 to 8, each of which latches the position and the time since the last count at a rising "
    "edge, with method track also the fine position; or the edges of each, such as rising,falling,both. A probe waits "
    "until it is armed again."
)
TIME_WIDTH = 32  # bits of the time since a count, at most
RISING, FALLING = 1, 2  # bits of the edges that latch
_EDGES = {"rising": RISING, "falling": FALLING, "both": RISING | FALLING}


def parse_probes(what: str, text: str) -> str:
    """Return the edges of each probe, with commas between, of these or of a number of probes that latch rises.

    It raises ParameterError if it is neither, or there are none or too many.
    """
    word = text.strip().lower()
    few = word.isascii() and word.isdecimal() and len(word) < 3
    edges = ["rising"] * int(word) if few else [each.strip() for each in word.split(",")]
    if not 1 <= len(edges) <= MOST_PROBES or not set(edges) <= set(_EDGES):
        form = f"must be a number of probes from 1 to {MOST_PROBES}, or the edges of each, such as rising,falling,both"
        raise ParameterError(what, f"{form}, not {text!r}")
    return ",".join(edges)


def edges_of(probes: str) -> tuple[int, ...]:
    """Return the edges at which each probe latches, in bits `RISING` and `FALLING`, of what `parse_probes` takes."""
    return tuple(_EDGES[edge] for edge in parse_probes("probe", probes).split(",")) if probes else ()


def packed_edges(probes: str) -> int:
    """Return the same as one number, with two bits for each probe, the first lowest."""
    return sum(edges << 2 * number for number, edges in enumerate(edges_of(probes)))
