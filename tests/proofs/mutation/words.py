"""Survivors that are no other cores, as words say where the proof does not reach.

By the core, the line of the HDL, and what the mutant does to what Yosys made of it: B is the value that a reset gives,
S whether there is one.
"""

from pathlib import Path

from proofs.mutation.netlist import Mutant

ROOT = Path(__file__).parents[3]
_NO_COUNT = (
    "read in the sign of a distance, once a count has set it, and where the velocity decays: it is 0 until then, and "
    "what the time allows is no less"
)

IN_WORDS = {
    ("t, in clocks", '"was_negative": Out(1),', "S[0] const0"): _NO_COUNT,
    ("t, in clocks", '"was_negative": Out(1),', "B[0] inv"): _NO_COUNT,
    ("t, in clocks", "quotient.decay.eq(self.tick & ~timer.count),", "Y[0] const1"): (
        "a count measures but while a measurement is divided, when nothing decays, and if none came in the maximum "
        "time: then the velocity is 0, what the time allows is no less, and a measurement takes the divider anyway"
    ),
    ("t, in ticks", "above.eq(value > Const(limit, value.shape())),", "B[2] inv"): (
        "the limit of the output is 127, or 123; velocities are 2^5·2π/m, and of these 201 and 100 are next to it"
    ),
    ("mt, in clocks", '"was_negative": Out(1),', "B[0] const1"): _NO_COUNT,
    ("mt, in clocks", "change = Signal(signed(max(len(shown), spec.native_width) + 1))", "change[6] const0"): (
        "read where the velocity decays, whether it does at all: from −48 at most to no more than 0, less than 64"
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
