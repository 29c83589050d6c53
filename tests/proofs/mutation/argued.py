"""Survivors that are equivalent to the core by an argument made by hand, where the proof does not reach.

The keys are the core, the line of the HDL, and what the mutant changes in the cell that Yosys made of that line, with
the cell where the line has several of a kind; some multiplexers that Yosys makes have no line. B is the value that a
reset gives, and S is whether there is a reset.
"""

import json
from pathlib import Path

from proofs.mutation.netlist import Mutant

ROOT = Path(__file__).parents[3]
ARGUED: dict[tuple[str, str, str], str] = {
    (core, line, change): argument
    for argument, *changes in json.loads(Path(__file__).with_name("argued.json").read_text(encoding="utf-8"))
    for core, line, change in changes
}


def argued(core: str, mutant: Mutant) -> bool:
    """Tell whether an argument covers a mutant of a core."""
    place = f".{mutant.place}"
    lines = [_line(*source.split(":")) for source in mutant.lines if source.startswith("hdl/")] or [""]
    return any(key[0] == core and key[1] in lines and place.endswith(f".{key[2]}") for key in ARGUED)


def _line(file: str, number: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8").splitlines()[int(number.split(".")[0]) - 1].strip()
