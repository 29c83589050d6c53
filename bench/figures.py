"""Writes what the papers say and what `tachometry figures` computed into docs/measured/figures.md."""

import argparse
import csv
from collections.abc import Sequence
from itertools import groupby
from pathlib import Path

from pages import markdown, stamp, write_block

ROOT = Path(__file__).resolve().parent.parent
HEADS = ("the paper says", "computed", "agrees")


def main(words: Sequence[str] | None = None) -> None:
    """Read the claims that the command has written, and replace the table and the picture of each figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("claims", type=Path, help="claims.csv of the command")
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "docs" / "measured" / "figures.md", metavar="PAGE")
    given = parser.parse_args(words)
    with given.claims.open(encoding="utf-8", newline="") as file:
        for figure, claims in groupby(csv.DictReader(file), lambda row: row["figure"]):
            rows = [[claim[name].replace("|", "") for name in ("paper", "found", "agrees")] for claim in claims]
            write_block(given.output, figure, markdown(HEADS, rows, left=range(3)))
            picture = given.output.parent / "figures" / f"{figure}.png"
            picture.write_bytes(given.claims.with_name(picture.name).read_bytes())
            stamp(picture)


if __name__ == "__main__":
    main()
