"""Codes of what can be wrong with an encoder, which a core that watches it shows, and when it finds so."""

from dataclasses import dataclass
from enum import IntEnum

from tachometry.spec.core.timing import parse_filter
from tachometry.spec.language.option import check_options, option


class Fault(IntEnum):
    """Names a fault; 0 is none. Of faults in one clock the lowest is shown."""

    A_STANDS = 1
    B_STANDS = 2
    INDEX_COUNTS = 3
    ILLEGAL = 4
    A_OPEN = 5
    B_OPEN = 6
    Z_OPEN = 7
    INDEX_MISSED = 8


FAULT_WIDTH = 4  # bits of a code
FAULTS_WIDTH = 8  # bits of the number of faults, which stays at its end
FAULT_TEXTS = {
    Fault.A_STANDS: "line a stands while b has edges: broken or shorted",
    Fault.B_STANDS: "line b stands while a has edges: broken or shorted",
    Fault.INDEX_COUNTS: "counts are lost or extra between two indices",
    Fault.ILLEGAL: "too many illegal transitions in a second",
    Fault.A_OPEN: "line a equals its complement a_n: an open circuit",
    Fault.B_OPEN: "line b equals its complement b_n: an open circuit",
    Fault.Z_OPEN: "line z equals its complement z_n: an open circuit",
    Fault.INDEX_MISSED: "z comes and goes without the state of --index-at",
}
COMPLEMENTS = (2, 1 << 20)  # the least and the most clocks
OPEN = {"a": Fault.A_OPEN, "b": Fault.B_OPEN, "z": Fault.Z_OPEN}  # of lines that have a complement


@dataclass(frozen=True)
class Health:
    """Says when a core that watches its encoder finds a fault of it.

    It raises ParameterError if a number is out of range.
    """

    edges: int = option(
        256,
        "N edges of a line in a second, 2 to 65536, and none of the other, are a fault of the other. A shaft that "
        "swings about one edge has such edges as well (with --health).",
        name="health-edges",
        metavar="N",
        limits=(2, 1 << 16),
        tests=("5",),
        tacit=True,
    )
    errors: int = option(
        10,
        "More than N illegal transitions in a second, 0 to 65535, are a fault (with --health).",
        name="health-errors",
        metavar="N",
        limits=(0, (1 << 16) - 1),
        tests=("0",),
        tacit=True,
    )
    complements: int | None = option(
        None,
        "Inputs a_n and b_n, and z_n with --index, of a differential encoder (with --health): a line that equals its "
        "complement for longer than TIME is an open circuit, a fault. In s, ms, us or ns, rounded up to clocks; a "
        "plain number is clocks. 1us is more than receivers and cables skew.",
        name="complements",
        metavar="TIME",
        parse_at=parse_filter,
        tests=("2", "40"),
        tacit=True,
    )

    def __post_init__(self) -> None:
        check_options(self)
