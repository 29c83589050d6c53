"""How many wrong lines of spec/, the golden models and the comparison the tests notice: `make mutate`."""

import argparse
import os
import shutil
import sys
from importlib import import_module
from pathlib import Path

from proofs.python_mutation.covered import chosen_for, covered, with_imports
from proofs.python_mutation.judge import Verdict, judge_all
from proofs.python_mutation.mutants import ARGUED, ROOMS, files, sample
from support.report import Table

ROOT = Path(__file__).parents[3]
LEAST = 0.95  # of the mutants that are not equivalent
# Tests of what the mutated files decide; those of engines, pages and processes run them, too, but take long. The gates
# are what the golden models are held against.
TESTS = (
    "spec sim hdl/export hdl/front_end hdl/output hdl/methods hdl/bus hdl/axes hdl/control hdl/core "
    "cli/options independent test_ports.py test_matrix.py"
).split()
# Imported once, and shared by all forks.
_WARM = ("numpy", "click", "rich.console", "rich.table", "amaranth.back.verilog", "amaranth.sim", "pytest", "vcd.gtkw")


def main(words: list[str]) -> bool:
    """Tell whether enough mutants were killed; prints the tables."""
    parser = argparse.ArgumentParser(prog="python -m proofs.python_mutation", description=__doc__)
    parser.add_argument("--mutants", type=int, default=230, metavar="N", help="so many of all")
    parser.add_argument("--seed", type=int, default=2, help="which ones")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, metavar="N", help="processes")
    parser.add_argument("--budget", type=float, default=30.0, metavar="S", help="seconds of tests for a mutant")
    parser.add_argument("--only", default="", metavar="PATH", help="of these, those of files whose path begins so")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose table is replaced")
    parser.add_argument("tests", nargs="*", help="paths in tests/ [default: all that matter]")
    given = parser.parse_args(words)
    folder = ROOT / "build" / "python_mutation"
    os.environ["TACHOMETRY_CACHE"] = str(folder / "cache")
    os.chdir(ROOT)
    for module in _WARM:
        import_module(module)
    tests = [f"tests/{path}" for path in given.tests or TESTS]
    found = with_imports(ROOT, covered(ROOT, files(ROOT), tests, folder))
    jobs = []
    for mutant in sample(ROOT, given.mutants, given.seed):
        if not mutant.file.startswith(given.only):
            continue
        chosen = chosen_for(found, mutant.file, mutant.line, given.budget)
        jobs.append((mutant, chosen, sum(found[test]["seconds"] for test in chosen)))

    def told(verdict: Verdict) -> None:
        if verdict.what not in ("killed", "timeout"):
            print(f"{verdict.what}: {verdict.mutant.line}: {verdict.mutant.name}", file=sys.stderr, flush=True)

    verdicts = judge_all(ROOT, jobs, given.jobs, folder, told)
    for left in folder.glob("tmp-*"):
        shutil.rmtree(left, ignore_errors=True)
    return report(verdicts, given.output)


def report(verdicts: list[Verdict], page: Path | None = None) -> bool:
    """Tell whether enough were killed, after the table and the survivors."""
    table = Table("room", "mutants", "killed", "of these by timeout", "argued by hand", "survivors", "score")
    fine = True
    for room in ROOMS:
        those = [verdict for verdict in verdicts if verdict.mutant.room == room]
        killed = sum(verdict.what in ("killed", "timeout") for verdict in those)
        late = sum(verdict.what == "timeout" for verdict in those)
        argued = sum(verdict.what not in ("killed", "timeout") and verdict.mutant.name in ARGUED for verdict in those)
        wrong = len(those) - argued
        fine &= killed >= LEAST * wrong
        table.add(room, len(those), killed, late, argued, wrong - killed, f"{100 * killed / max(wrong, 1):.1f} %")
    table.write(page, "python")
    left = [v.mutant for v in verdicts if v.what not in ("killed", "timeout") and v.mutant.name not in ARGUED]
    for mutant in left:
        print(f"  {mutant.line}: {mutant.name}")
    return fine


if __name__ == "__main__":
    sys.exit(not main(sys.argv[1:]))
