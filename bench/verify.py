"""Compares all engines with the golden models by `tachometry verify`, for docs/measured/evidence.md."""

from functools import partial

from pages import MEASURED, ROOT, Rows, measure, tachometry

from tachometry.spec import METHODS


def table(printed: str) -> Rows:
    """Return the table that the command has printed."""
    lines = [line.split() for line in printed.splitlines()]
    rows = [words for words in lines if words and words[0] in ("method", *METHODS)]
    return [row for row in rows if len(row) == len(rows[0])]


def verified(engines: str, clocks: int) -> Rows:
    """Return the table of some engines, each with this number of clocks, spread over the configurations."""
    return table(tachometry("verify", "--engines", engines, "--clocks", clocks, "-o", ROOT / "build" / "verify"))


BLOCKS = {"verify": partial(verified, "all"), "verify-every-clock": partial(verified, "cxxrtl-every-clock")}

if __name__ == "__main__":
    measure(MEASURED / "evidence.md", BLOCKS, clocks=1_000_000_000)
