"""Codes of what can be wrong with an encoder, which a core that watches it shows."""

from enum import IntEnum


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
OPEN = {"a": Fault.A_OPEN, "b": Fault.B_OPEN, "z": Fault.Z_OPEN}  # of lines that have a complement
