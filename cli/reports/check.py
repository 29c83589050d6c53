"""`check` prints a row for each file, what the simulation says, and the verdict."""

from collections.abc import Sequence

from rich.text import Text

from tachometry.cli.reports.terminal import print_table, stdout_console
from tachometry.sim.testbench.check import Checked


def print_checked(results: Sequence[Checked]) -> int:
    """Print what was found of each core; the exit status."""
    console = stdout_console()
    for checked in results:
        if checked.unchecked:
            console.print(Text(f"{checked.manifest} was not checked: {checked.unchecked}"), soft_wrap=True)
            continue
        rows = [(file, found, where) for file, (found, where) in checked.files.items()]
        print_table((str(checked.manifest.parent), "", ""), rows, left=(0, 1, 2))
        name = checked.manifest.stem
        if checked.simulated:
            console.print(Text(f"{name} differs from the golden model: {checked.simulated}"), soft_wrap=True)
        elif checked.why_not:
            console.print(Text(f"{name} was not simulated: {checked.why_not}"), soft_wrap=True)
    wrong = sum(not checked.right for checked in results)
    cores = f"{len(results)} core{'s' * (len(results) != 1)}"
    if wrong:
        console.print(Text(f"FAIL: {wrong} of {cores} not as the manifest says", style="bold red"), soft_wrap=True)
        return 1
    n_files = sum(len(checked.files) for checked in results)
    played = sum(checked.simulated == "" for checked in results)
    agree = f"{played} agree with the golden model" if played else "none was simulated"
    verdict = f"PASS: {n_files} files of {cores} are what the manifests say; {agree}"
    console.print(Text(verdict, style="bold green"), soft_wrap=True)
    return 0
