"""Tables and words of the commands of the tests: `python -m proofs.formal`, `mutation`, `upset`."""

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

from support.script import load


def arguments(text: str, metavar: str) -> argparse.ArgumentParser:
    """Return a command that takes names, and a page to write its tables into."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar=metavar, help="only these")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose tables are replaced")
    return parser


class Table:
    """A table in Markdown that is printed line by line; `left` are the columns of words."""

    def __init__(self, *heads: str, left: Sequence[int] = (0,)) -> None:
        self.lines: list[str] = []
        self.add(*heads)
        self.add(*("---" if column in left else "---:" for column in range(len(heads))))

    def add(self, *cells: object) -> None:
        """Print a row."""
        self.lines.append("| " + " | ".join(str(cell).replace("|", r"\|") for cell in cells) + " |\n")
        print(self.lines[-1], end="", flush=True)

    def write(self, page: Path | None, block: str) -> None:
        """Put the table into a block of a page, if there is one."""
        if page is not None:
            load("pages").write_block(page, block, "".join(self.lines))


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
