"""Proves every property of the exported core, and that no proof holds for its mutants: `make formal`.

Names of proofs as arguments choose those and their mutants; `quick` chooses one of every checker, without mutants.
"""

import os
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from proofs.formal.cases import PROOFS, QUICK
from proofs.formal.mutants import MUTANTS, Mutant, mutant
from proofs.formal.prove import Proof, Result, prepare, solve
from support.report import Table, arguments, chosen

_FOLDER = Path("build/formal")


def _exported(proof: Proof, wrong: Mutant | None = None) -> str:
    if wrong is None:
        return proof.exported()
    with mutant(wrong.box, wrong.right, wrong.wrong):
        return proof.exported()


def _properties(result: Result) -> str:
    return ", ".join(name for name in result.names if name.startswith("p"))


def _prove(proofs: dict[str, Proof], mutants: list[Mutant]) -> tuple[list[Result], list[Result]]:
    """Solve all proofs, and those of their mutants.

    The solvers run beside the exports. Mutants exist one at a time, and only after the right cores were exported.
    """
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        right = [
            pool.submit(solve, proof, _exported(proof), _FOLDER, f"proof{number}")
            for number, proof in enumerate(proofs.values())
        ]
        refuted = []
        for number, wrong in enumerate(mutants):
            proof = proofs[wrong.proof]
            text = _exported(proof, wrong)
            refuted.append(pool.submit(solve, proof, text, _FOLDER, f"mutant{number}", wrong.refuted, wrong.steps))
        return [future.result() for future in right], [future.result() for future in refuted]


def _row(proof: Proof, result: Result, refuted: list[tuple[Mutant, Result]]) -> tuple[str, ...]:
    begin = f"any state, {proof.recovers} clocks" if proof.recovers else f"{result.depth} clocks"
    begin = f"given, {begin}" if proof.given else begin
    wrong = ", ".join(f"{mutant.refuted} {found.depth}" for mutant, found in refuted)
    return proof.name, _properties(result), begin, f"{result.seconds:.0f}", result.verdict, wrong


def main(words: list[str]) -> bool:
    """Return whether all was as it should be; prints the table."""
    given = arguments(__doc__ or "", "PROOF").parse_args(words)
    quick = given.names == ["quick"]
    names = chosen("proof", QUICK if quick else given.names, (proof.name for proof in PROOFS))
    prepare(_FOLDER)
    proofs = {proof.name: proof for proof in PROOFS if proof.name in names}
    mutants = [wrong for wrong in MUTANTS if wrong.proof in proofs and not quick]
    right, refuted = _prove(proofs, mutants)
    judged = list(zip(mutants, refuted, strict=True))
    table = Table("core", "properties", "induction", "seconds", "verdict", "wrong cores refuted in")
    for proof, result in zip(proofs.values(), right, strict=True):
        table.add(*_row(proof, result, [(wrong, found) for wrong, found in judged if wrong.proof == proof.name]))
    table.write(given.output)
    for wrong, found in judged:
        if found.verdict != "refuted":
            print(f"\n{wrong.refuted} of {wrong.proof} is {found.verdict} with {wrong.box.__name__}: {wrong.wrong}")
    proven = {name for result in right for name in result.names if name.startswith("p")}
    without = set() if given.names else proven - {wrong.refuted for wrong in mutants}
    if without:
        print(f"\nwithout a mutant: {', '.join(sorted(without))}")
    fine = all(result.verdict == "proven" for result in right) and all(one.verdict == "refuted" for one in refuted)
    return fine and not without


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
