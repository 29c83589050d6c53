"""What the commands of the tests print and are told: `python -m proofs.formal`, `mutation`, `upset`."""

import sys
from collections.abc import Iterable


def row(*cells: object) -> None:
    """A line of a table in Markdown."""
    print("| " + " | ".join(str(cell).replace("|", r"\|") for cell in cells) + " |", flush=True)


def chosen(what: str, words: Iterable[str], known: Iterable[str]) -> list[str]:
    """Those known that the words name, all if there are none; a word that is not known ends the command with 2."""
    wanted, known = list(words), list(known)
    for word in wanted:
        if word not in known:
            print(f"{what} must be one of {'; '.join(known)}, not {word}", file=sys.stderr)
            sys.exit(2)
    return [name for name in known if not wanted or name in wanted]
