"""`verify` prints a row per method and engine, what differs, and the verdict."""

import sys
from collections.abc import Sequence

from rich.text import Text

from tachometry.cli.reports.standard_streams import INTERRUPTED
from tachometry.cli.reports.terminal import print_table, stdout_console
from tachometry.sim.studies.verify import Verification

_HEADS = ("method", "engine", "configurations", "motions", "clocks", "ticks", "updates", "mismatches", "seconds")


def print_verification(
    verification: Verification, methods: Sequence[str], engines: Sequence[str], differences: Sequence[str]
) -> int:
    """Print the table, the differences and, if there is one, the verdict; the exit status."""
    rows = []
    total = dict.fromkeys(_HEADS[3:], 0.0)
    for method in methods:
        for engine in engines:
            outcomes = [outcome[engine] for core, outcome in verification.outcomes if core.method == method]
            sums = {
                head: sum(getattr(outcome, head if head == "seconds" else f"n_{head}") for outcome in outcomes)
                for head in total
            }
            rows.append((method, engine, str(len(outcomes)), *(f"{value:.0f}" for value in sums.values())))
            for head, value in sums.items():
                total[head] += value
    print_table(_HEADS, rows, left=(0, 1))
    console = stdout_console()
    for difference in differences:
        console.print(Text(f"differs: {difference}"), soft_wrap=True)
    n_done, failed = len(verification.outcomes), bool(total["mismatches"])
    if failed:
        verdict = f"FAIL: hardware and golden model differ in {total['mismatches']:.0f} values"
        console.print(Text(verdict, style="bold red"), soft_wrap=True)
    elif n_done == verification.n_cores:
        agreement = f"{total['updates']:.0f} updates and {total['ticks']:.0f} ticks"
        verdict = f"PASS: {', '.join(engines)} and golden models agree in every bit of {agreement}"
        console.print(Text(verdict, style="bold green"), soft_wrap=True)
    if n_done < verification.n_cores:
        print(f"tachometry: interrupted after {n_done} of {verification.n_cores} configurations", file=sys.stderr)
    return 1 if failed else INTERRUPTED if n_done < verification.n_cores else 0
