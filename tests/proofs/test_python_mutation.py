"""The short form of the second half of `make mutate`: what is mutated, and that a mutant is noticed or not."""

import ast
import os
import subprocess
import sys
from pathlib import Path

from proofs.python_mutation.mutants import ARGUED, ROOMS, files, mutants_of, mutated, sample
from support.nightly import nightly

ROOT = Path(__file__).parents[2]
FILE = "spec/methods/adaptive.py"


def test_mutants_change_one_expression_each() -> None:
    source = ast.unparse(ast.parse((ROOT / FILE).read_text(encoding="utf-8")))
    found = {ast.unparse(mutated(ROOT, mutant)) for mutant in mutants_of(ROOT, FILE)}
    assert source not in found
    assert len(found) == len(mutants_of(ROOT, FILE)) > 20


@nightly  # it draws four times from all files, for `make mutate` only
def test_the_same_thousand_is_drawn_from_every_room() -> None:
    chosen = sample(ROOT, 1000, seed=1)
    assert len(chosen) == len(set(chosen)) == 1000
    assert chosen == sample(ROOT, 1000, seed=1)
    assert {mutant.room for mutant in chosen} == set(ROOMS)
    assert set(sample(ROOT, 100, seed=1)) < set(chosen)
    assert set(sample(ROOT, 1000, seed=2)) != set(chosen)


@nightly  # for the same reason
def test_a_change_elsewhere_does_not_change_what_is_drawn(tmp_path: Path) -> None:
    """A line above, and a file that has lost all of its mutants."""
    for file in files(ROOT):
        text = (ROOT / file).read_text(encoding="utf-8")
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(f"\n{text}" if file != FILE else "", encoding="utf-8")
    before = {mutant.name for mutant in sample(ROOT, 1000, seed=1) if mutant.file != FILE}
    after = {mutant.name for mutant in sample(tmp_path, 1000, seed=1)}
    assert before <= after


@nightly  # what the arguments are of is drawn by `make mutate` only
def test_every_argument_is_of_a_mutant() -> None:
    assert ARGUED.keys() <= {mutant.name for file in files(ROOT) for mutant in mutants_of(ROOT, file)}


SCRIPT = """
import sys
from pathlib import Path
from proofs.python_mutation import judge
from proofs.python_mutation.judge import judge_all
from proofs.python_mutation.mutants import mutants_of
judge._STARTED = 5
root, folder = Path(sys.argv[1]), Path(sys.argv[2])
tests = ["tests/spec/core/test_spec.py::test_widths_hold_what_they_must"]
jobs = [(m, tests, 1.0) for m in mutants_of(root, "spec/language/units.py") if m.where == "signed_width"][:1]
jobs += [(m, tests, 1.0) for m in mutants_of(root, "sim/golden/low_pass.py")][:1]  # which they never run
jobs += [(jobs[0][0], [], 0.0)]
digits = ["tests/spec/formats/test_formats.py::test_the_product_is_a_sum_of_few_shifted_terms"]
endless = [m for m in mutants_of(root, "spec/formats/velocity_output.py") if m.where == "_canonical"]
jobs += [(m, digits, 0.0) for m in endless if m.change == "1 → 0 #2"]  # a number that never becomes 0
for verdict in sorted(judge_all(root, jobs, 2, folder, lambda verdict: None), key=lambda v: v.mutant.file + v.what):
    print(verdict.what)
"""


@nightly  # it runs tests anew for each of four wrong lines
def test_a_wrong_line_is_noticed_by_its_tests_alone(tmp_path: Path) -> None:
    command = [sys.executable, "-P", "-c", SCRIPT, str(ROOT), str(tmp_path)]
    env = {**os.environ, "PYTHONPATH": str(ROOT / "tests")}
    done = subprocess.run(command, cwd=ROOT, env=env, check=True, capture_output=True, text=True)
    assert done.stdout.split() == ["survived", "timeout", "killed", "untested"]
