"""Draws the papers' figures, and compares them with what the papers say: `make figures`.

Exit status 1: hardware and golden model differ.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from pages import markdown, stamp, write_block

from papers import FIGURES, LOOPS
from papers.drawing import write_data, write_figure
from papers.lab import Lab
from tachometry.sim.build import find_compiler

HEADS = ("the paper says", "computed", "agrees")


def draw(name: str, hdl: bool, folder: Path, page: Path | None) -> int:
    """Draw a figure, print its claims, and put both into the page if there is one; return the mismatches."""
    lab = Lab(hdl)
    result = FIGURES[name](lab)
    picture = folder / f"{name}.png"
    for path in (picture, picture.with_suffix(".svg")):
        write_figure(path, result)
    write_data(picture.with_suffix(".csv"), result)
    rows = [(claim.paper, claim.found, "yes" if claim.agrees else "no") for claim in result.claims]
    table = markdown(HEADS, [[cell.replace("|", "") for cell in row] for row in rows], left=range(3))
    print(f"{name}: {result.source}, {result.title}\n\n{table}", *lab.first, sep="\n", flush=True)
    if page is not None:
        write_block(page, name, table)
        shown = page.parent / "figures" / picture.name
        shown.write_bytes(picture.read_bytes())
        stamp(shown)
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
