"""How many wrong cores the tests' motions tell from the right one: `make mutate`.

Names of methods as arguments choose those, `registers` what is around a core, `axes` cores of many, and `loop` control
loops.
"""

import os
import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

from proofs.mutation.boxes import BOXES
from proofs.mutation.cases import CASES
from proofs.mutation.score import Score, judge
from support.report import Table, arguments, chosen

from tachometry.spec import METHODS

GROUPS = (*METHODS, "registers", "axes", "loop")
LEAST = 0.99  # of the mutants that are not equivalent


def _cells(scores: list[Score]) -> tuple[int, ...]:
    """Return numbers of all mutants, and of those that were killed, are equivalent, were argued, and survive."""
    numbers = [(one.mutants, one.killed, one.equivalent, one.argued, len(one.survivors)) for one in scores]
    return tuple(sum(column) for column in zip(*numbers, strict=True))


def _share(scores: list[Score]) -> float:
    """Tell how many were killed of those that are not equivalent."""
    mutants, killed, equivalent, argued, _ = _cells(scores)
    return killed / (mutants - equivalent - argued)


def _judge_group(group: str, pool: Executor, page: Path | None) -> list[Score]:
    """Judge and print the cores of a group."""
    scores: list[Score] = []
    print()
    table = Table("core", "mutants", "killed", "equivalent", "argued by hand", "survivors", "score")
    for case in (case for case in (*CASES, *BOXES) if case.group == group):
        scores.append(judge(case, pool))
        table.add(case.name, *_cells(scores[-1:]), f"{100 * _share(scores[-1:]):.1f} %")
    table.add(f"{group}, all", *_cells(scores), f"{100 * _share(scores):.1f} %")
    table.write(page, group)
    for score in scores:
        if score.survivors:
            print(f"\nsurvivors of {score.case.name}:")
        for mutant in score.survivors:
            print(f"  {', '.join(mutant.lines)}: {mutant.place}")
    return scores


def main(words: list[str]) -> bool:
    """Tell whether enough mutants of every group were killed; prints the tables."""
    given = arguments(__doc__ or "", "GROUP").parse_args(words)
    known = [group for group in GROUPS if any(case.group == group for case in (*CASES, *BOXES))]
    groups = chosen("group", given.names, known)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return all([_share(_judge_group(group, pool, given.output)) >= LEAST for group in groups])


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
