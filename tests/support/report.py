"""Tables and words of the commands of the tests: `python -m proofs.formal`, `mutation`, `upset`."""

import argparse
import sys
from collections.abc import Iterable
from pathlib import Path

from support.script import load


def arguments(text: str, metavar: str) -> argparse.ArgumentParser:
    """Return a command that takes names, and a file to write its table into."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar=metavar, help="only these")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="table of CSV whose rows are replaced")
    return parser


class Table:
    """A table that is printed line by line in Markdown."""

    def __init__(self, *heads: str) -> None:
        self.rows: list[list[str]] = []
        self.add(*heads)
        print("| --- " * len(heads) + "|")

    def add(self, *cells: object) -> None:
        """Print a row."""
        self.rows.append([str(cell) for cell in cells])
        print(f"| {' | '.join(self.rows[-1])} |", flush=True)

    def write(self, file: Path | None) -> None:
        """Replace the rows of these names in a table of CSV, if there is one."""
        if file is not None:
            load("pages").write_table(file, self.rows, merge=file.exists())


def chosen(what: str, words: Iterable[str], known: Iterable[str]) -> list[str]:
    """Return those known that the words name, all if there are none; a word that is not known ends the command with
    2.
    """
    wanted, known = list(words), list(known)
    for word in wanted:
        if word not in known:
            print(f"{what} must be one of {'; '.join(known)}, not {word}", file=sys.stderr)
            sys.exit(2)
    return [name for name in known if not wanted or name in wanted]
