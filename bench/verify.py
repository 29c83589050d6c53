"""Compares all engines with the golden models by `tachometry verify`, for docs/measured/verify.md."""

from functools import partial

from pages import MEASURED, ROOT, markdown, measure, tachometry

from tachometry.spec import METHODS


def table(printed: str) -> str:
    """Return the table that the command has printed."""
    lines = [line.split() for line in printed.splitlines()]
    rows = [words for words in lines if words and words[0] in ("method", *METHODS)]
    return markdown(rows[0], [row for row in rows[1:] if len(row) == len(rows[0])], left=(0, 1))


def verified(engines: str, clocks: int) -> str:
    """Return the table of some engines, each with so many clocks, spread over the configurations."""
    return table(tachometry("verify", "--engines", engines, "--clocks", clocks, "-o", ROOT / "build" / "verify"))


BLOCKS = {"engines": partial(verified, "all"), "every-clock": partial(verified, "cxxrtl-every-clock")}

if __name__ == "__main__":
    measure(MEASURED / "verify.md", BLOCKS, clocks=1_000_000_000)
