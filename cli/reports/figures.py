"""`figures` prints which figures agree with their papers, and where they do not."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from tachometry.cli.reports.terminal import print_table, stdout_console

if TYPE_CHECKING:  # numpy and Amaranth are slow to import, and --help needs neither
    from tachometry.sim.figures.lab import Lab
    from tachometry.sim.figures.result import Result


def print_figures(results: Mapping[str, Result], labs: Mapping[str, Lab], directory: Path) -> None:
    """Print a row per figure, the claims that do not agree, and the first mismatches."""
    heads, rows = ("figure", "paper", "agrees", "hardware"), []
    for name, result in results.items():
        agreeing, lab = sum(claim.agrees for claim in result.claims), labs[name]
        agrees = "yes" if result.agrees else f"in {agreeing} of {len(result.claims)} claims"
        rows.append(
            (name, result.source, agrees, f"{lab.mismatches} mismatches in {lab.locked} clocks" if lab.locked else "-")
        )
    print_table(heads, rows, left=range(len(heads)))
    console = stdout_console()
    for name, result in results.items():
        for claim in result.claims:
            if not claim.agrees:
                console.print(Text(f"\n{name}: the paper says: {claim.paper}. Found: {claim.found}."))
    for name, lab in labs.items():
        for mismatch in lab.first:
            console.print(Text(f"{name}: first mismatch in {mismatch}", style="bold red"))
    agreeing = sum(result.agrees for result in results.values())
    console.print(Text(f"\n{agreeing} of {len(results)} figures agree with all that the papers say; see {directory}."))
