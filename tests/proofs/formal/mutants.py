"""Each proof must refute mutants, listed in mutants.json: a row has the entries of a `Mutant`, the box by its name."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from proofs.source import modules


@dataclass(frozen=True)
class Mutant:
    """`right` in the source of `box` made `wrong`: violates `refuted` within `steps` clocks in the proof's core."""

    proof: str
    refuted: str
    box: Any
    right: str
    wrong: str
    steps: int = 24


_BOXES = {
    name: box
    for module in modules()
    for name, box in vars(module).items()
    if getattr(box, "__module__", None) == module.__name__
}
MUTANTS = [
    Mutant(proof, refuted, _BOXES[box], *change)
    for proof, refuted, box, *change in json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8"))
]
