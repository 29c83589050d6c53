"""How many wrong cores the tests' motions tell from the right one: `make mutate`.

Names of methods as arguments choose those, `registers` what is around a core, `axes` cores of many, and `loop` control
loops.
"""

import os
import sys
import time
from concurrent.futures import ThreadPoolExecutor

from proofs.mutation.boxes import BOXES
from proofs.mutation.cases import CASES
from proofs.mutation.score import Score, judge
from support.report import chosen, row

from tachometry.spec import METHODS

GROUPS = (*METHODS, "registers", "axes", "loop")
LEAST = 0.99  # of the mutants that are not equivalent


def main(words: list[str]) -> bool:
    """Whether enough mutants of every method were killed; prints the tables."""
    groups = chosen("group", words, GROUPS)
    scores: list[Score] = []
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        row("core", "mutants", "killed", "equivalent", "argued by hand", "survivors", "seconds")
        row("---", *["---:"] * 6)
        for case in (*CASES, *BOXES):
            if case.group in groups:
                start = time.monotonic()
                score = judge(case, pool)
                scores.append(score)
                seconds = f"{time.monotonic() - start:.0f}"
                row(
                    *(case.name, score.mutants, score.killed, score.equivalent),
                    *(score.argued, len(score.survivors), seconds),
                )
    print()
    row("group", "mutants", "killed", "equivalent", "argued by hand", "survivors", "score")
    row("---", *["---:"] * 6)
    fine = True
    for group in groups:
        of_method = [score for score in scores if score.case.group == group]
        if not of_method:
            continue
        mutants, killed, equivalent, argued = (
            sum(getattr(score, name) for score in of_method) for name in ("mutants", "killed", "equivalent", "argued")
        )
        wrong = mutants - equivalent - argued
        fine &= killed >= LEAST * wrong
        row(group, mutants, killed, equivalent, argued, wrong - killed, f"{100 * killed / wrong:.1f} %")
    for score in scores:
        if score.survivors:
            print(f"\nsurvivors of {score.case.name}:")
        for mutant in score.survivors:
            print(f"  {', '.join(mutant.lines)}: {mutant.place}")
    return fine


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
