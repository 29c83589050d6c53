"""Proves every property of the exported core, and that no proof holds for its mutants: `make formal`.

Names of proofs as arguments choose those and their mutants; `quick` chooses one of every checker, without mutants.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from proofs.formal.cases import PROOFS, QUICK
from proofs.formal.mutants import MUTANTS, Mutant
from proofs.formal.prove import Proof, Result, prepare, solve
from support.mutant import mutant
from support.report import chosen, row

_FOLDER = Path("build/formal")


def _exported(proof: Proof, wrong: Mutant | None = None) -> str:
    if wrong is None:
        return proof.exported()
    with mutant(wrong.box, wrong.right, wrong.wrong):
        return proof.exported()


def _properties(result: Result) -> str:
    return ", ".join(f"`{name}`" for name in result.names if name.startswith("p"))


def main(words: list[str]) -> bool:
    """Whether all was as it should be; prints the tables."""
    quick = words == ["quick"]
    names = chosen("proof", QUICK if quick else words, (proof.name for proof in PROOFS))
    prepare(_FOLDER)
    proofs = {proof.name: proof for proof in PROOFS if proof.name in names}
    mutants = [wrong for wrong in MUTANTS if wrong.proof in proofs and not quick]
    fine = True
    proven: set[str] = set()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        # The solvers run beside the exports. Mutants exist one at a time, and only after the right cores were exported.
        right = [
            pool.submit(solve, proof, _exported(proof), _FOLDER, f"proof{number}")
            for number, proof in enumerate(proofs.values())
        ]
        refuted = []
        for number, wrong in enumerate(mutants):
            proof = proofs[wrong.proof]
            text = _exported(proof, wrong)
            refuted.append(pool.submit(solve, proof, text, _FOLDER, f"mutant{number}", wrong.refuted, wrong.steps))
        row("core", "properties", "induction", "seconds", "verdict")
        row(*["---"] * 5)
        for proof, future in zip(proofs.values(), right, strict=True):
            result = future.result()
            fine &= result.verdict == "proven"
            proven.update(name for name in result.names if name.startswith("p"))
            begin = f"any state, {proof.recovers} clocks" if proof.recovers else f"{result.depth} clocks"
            begin = f"given, {begin}" if proof.given else begin
            row(proof.name, _properties(result), begin, f"{result.seconds:.0f}", result.verdict)
        if mutants:
            print()
            row("core", "property", "mutant", "refuted in", "seconds", "verdict")
            row(*["---"] * 6)
        for wrong, future in zip(mutants, refuted, strict=True):
            result = future.result()
            fine &= result.verdict == "refuted"
            before, after = (" ".join(text.split()) for text in (wrong.right, wrong.wrong))
            change = f"{wrong.box.__name__}: `{before}` → `{after}`"
            row(wrong.proof, wrong.refuted, change, f"{result.depth} clocks", f"{result.seconds:.0f}", result.verdict)
    without = set() if words else proven - {wrong.refuted for wrong in mutants}
    if without:
        print(f"\nwithout a mutant: {', '.join(sorted(without))}")
    return fine and not without


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
