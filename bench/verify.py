"""Holds all engines against the golden models with `tachometry verify`, and writes what was compared.

Exit status: that of the command.
"""

import argparse
import subprocess
import sys
import sysconfig
from collections.abc import Sequence
from pathlib import Path

from pages import markdown, write_block

from tachometry.spec import METHODS

ROOT = Path(__file__).resolve().parent.parent
# Blocks of the page, and the engines of each.
ENGINES = {"engines": "all", "every-clock": "cxxrtl-every-clock"}


def table(said: str) -> str:
    """Return the table that the command has printed."""
    rows = [line.split() for line in said.splitlines() if line.split()[:1] and line.split()[0] in ("method", *METHODS)]
    return markdown(rows[0], [row for row in rows[1:] if len(row) == len(rows[0])], left=(0, 1))


def main(words: Sequence[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--clocks", default="0", metavar="N", help="of each engine, spread over the configurations")
    parser.add_argument("-o", "--output", type=Path, metavar="PAGE", help="page whose tables are replaced")
    options = parser.parse_args(words)
    command = Path(sysconfig.get_path("scripts")) / "tachometry"
    for block, engines in ENGINES.items():
        call = [command, "verify", "--engines", engines, "--clocks", options.clocks, "-o", ROOT / "build" / "verify"]
        done = subprocess.run(call, stdout=subprocess.PIPE, text=True)
        print(done.stdout, flush=True)
        if done.returncode:
            return done.returncode
        if options.output is not None:
            write_block(options.output, block, table(done.stdout))
    return 0


if __name__ == "__main__":
    sys.exit(main())
