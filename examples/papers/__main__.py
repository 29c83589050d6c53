"""Draws the papers' figures, and compares them with what the papers say: `make figures`.

Exit status 1: hardware and golden model differ.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pages import markdown, read_table, stamp, write_block, write_table

from papers import FIGURES, LOOPS
from papers.drawing import write_data, write_figure
from papers.lab import Lab
from tachometry.sim.build import find_compiler

HEADS = ("figure", "the paper says", "computed", "agrees")


def shown(rows: Sequence[Sequence[str]]) -> str:
    """Return claims in Markdown."""
    return markdown(HEADS[:-1], [[cell.replace("|", "") for cell in row[:-1]] for row in rows], left=range(4))


def draw(name: str, hdl: bool, folder: Path, page: Path | None) -> int:
    """Draw a figure, print its claims, and put both into the page if there is one; return the mismatches."""
    lab = Lab(hdl)
    result = FIGURES[name](lab)
    picture = folder / f"{name}.png"
    for path in (picture, picture.with_suffix(".svg")):
        write_figure(path, result)
    write_data(picture.with_suffix(".csv"), result)
    rows = [(name, claim.paper, claim.found, "yes" if claim.agrees else "no") for claim in result.claims]
    print(f"{name}: {result.source}, {result.title}\n\n{shown(rows)}", *lab.first, sep="\n", flush=True)
    if page is not None:
        table = page.parent / "tables" / "papers.csv"
        write_table(table, [HEADS, *rows], merge=table.exists())
        write_block(page, "differ", shown([(*row.values(),) for row in read_table(table) if row["agrees"] == "no"]))
        copy = page.parent / "figures" / picture.name
        copy.write_bytes(picture.read_bytes())
        stamp(copy)
    return lab.mismatches


def main(words: Sequence[str] | None = None) -> int:
    """Draw the figures; return the exit status."""
    parser = argparse.ArgumentParser(prog="python -m papers", description=(__doc__ or "").splitlines()[0])
    known = [name for name in FIGURES if name not in LOOPS or find_compiler() is not None]
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=known, help="some of the figures")
    parser.add_argument("--no-hdl", dest="hdl", action="store_false", help="compute golden models only")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/figures"), help="folder (%(default)s)")
    parser.add_argument("--page", type=Path, help="page whose tables and pictures are replaced")
    given = parser.parse_args(words)
    given.output.mkdir(parents=True, exist_ok=True)
    return int(sum(draw(name, given.hdl, given.output, given.page) for name in given.only) > 0)


if __name__ == "__main__":
    sys.exit(main())
