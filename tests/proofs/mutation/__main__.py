"""How many wrong cores the tests' motions tell from the right one: `make mutate`.

Names of methods as arguments choose those, `registers` what is around a core, `axes` cores of many, `extras` options,
and `loop` control loops. A mutant that `survivors.json` has as killed must be killed again; -o writes that file, too.
"""

import json
import os
import sys
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

from proofs.mutation.boxes import BOXES
from proofs.mutation.cases import CASES
from proofs.mutation.score import Score, judge
from support.report import Table, arguments, chosen

from tachometry.spec import METHODS

GROUPS = (*METHODS, "registers", "axes", "extras", "loop")
LEAST = 0.80  # of all mutants, also of those that no input can show
SURVIVORS = Path(__file__).with_name("survivors.json")  # by core: digest of its sample, and indices in it


def _counts(scores: list[Score]) -> tuple[int, int, int]:
    """Return the numbers of mutants, of killed ones and of survivors."""
    mutants, survivors = sum(len(one.mutants) for one in scores), sum(len(one.survivors) for one in scores)
    return mutants, mutants - survivors, survivors


def _share(scores: list[Score]) -> float:
    """Return the share of the mutants that were killed."""
    mutants, killed, _ = _counts(scores)
    return killed / mutants


def _judge_group(group: str, pool: Executor, file: Path | None) -> list[Score]:
    """Judge and print the cores of a group."""
    scores: list[Score] = []
    print()
    table = Table("core", "mutants", "killed", "survivors", "score")
    for case in (case for case in (*CASES, *BOXES) if case.group == group):
        scores.append(judge(case, pool))
        table.add(case.name, *_counts(scores[-1:]), f"{100 * _share(scores[-1:]):.1f} %")
    table.add(f"{group}, all", *_counts(scores), f"{100 * _share(scores):.1f} %")
    table.write(file)
    return scores


def _passes(scores: list[Score], record: dict[str, tuple[str, list[int]]]) -> bool:
    """Return whether enough mutants of a group were killed, and all that were before; prints others."""
    lost = []
    for score in scores:
        digest, known = record.get(score.case.name, ("", []))
        new = {*score.survivors}.difference(known) if digest == score.digest else []
        lost += [f"{score.case.name}: {score.mutants[number]}" for number in sorted(new)]
    print("".join(f"\nwas killed before: {mutant}" for mutant in lost))
    return not lost and _share(scores) >= LEAST


def main(words: list[str]) -> bool:
    """Return whether enough mutants of every group were killed; prints the tables."""
    given = arguments(__doc__ or "", "GROUP").parse_args(words)
    known = [group for group in GROUPS if any(case.group == group for case in (*CASES, *BOXES))]
    groups = chosen("group", given.names, known)
    record = json.loads(SURVIVORS.read_text(encoding="utf-8"))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        scores = [_judge_group(group, pool, given.output) for group in groups]
    fine = all([_passes(group, record) for group in scores])
    if fine and given.output:
        record |= {score.case.name: (score.digest, score.survivors) for group in scores for score in group}
        rows = (f"{json.dumps(name)}: {json.dumps(row)}" for name, row in record.items())
        SURVIVORS.write_text("{\n" + ",\n".join(rows) + "\n}\n", encoding="utf-8")
    return fine


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
