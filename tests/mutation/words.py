"""Survivors that are no other cores, as words say where the induction does not reach.

By the core, the line of the HDL, and what the mutant does to what Yosys made of it: B is the value that a reset gives,
S whether there is one.
"""

from pathlib import Path

from mutation.netlist import Mutant

ROOT = Path(__file__).parent.parent.parent
_CARRIED = "read in the clock after a tick only, which sets it; a reset clears what reads"

IN_WORDS = {
    ("s, carried, serial", "carried = Signal()", "S[0] const0"): _CARRIED,
    ("s, carried, bounds", "carried = Signal()", "S[0] const0"): _CARRIED,
    ("s, table", "offset = Signal.like(self.m_e)", "B[0] const1"): (
        "the first window is not ready to count before its end, so that the first pulse number is 0, and becomes the "
        "offset whatever that was"
    ),
    ("s, carried, serial", "clocks_since_reset = Signal(4 if self._filter_clocks else 3)", "B[2] const1"): (
        "ready for one clock, in which the filter and the decoder still hold the levels of the reset: no step"
    ),
}


def in_words(core: str, mutant: Mutant) -> bool:
    """Whether the words are about a mutant of a core."""
    change = mutant.place.rpartition(".")[2]
    for place in mutant.lines:
        file, _, number = place.partition(":")
        if file.startswith("hdl/"):
            line = (ROOT / file).read_text(encoding="utf-8").splitlines()[int(number.split(".")[0]) - 1]
            if (core, line.strip(), change) in IN_WORDS:
                return True
    return False
